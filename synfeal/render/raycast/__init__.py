"""What the ray-casting backend is made of: mip-mapped textures and textured triangles."""
