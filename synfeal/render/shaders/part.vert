// With TEXTURED, COLORED, or both; HEADLIGHT for a lamp at the camera.
uniform mat4 clip_from_mesh;
in vec3 position;
#ifdef TEXTURED
in vec2 corner_uv;
out vec2 uv;
#endif
#ifdef COLORED
in vec3 corner_rgb;
out vec3 rgb;
#endif
#ifdef HEADLIGHT
uniform vec3 camera;  // where it is, in the mesh's frame
out vec3 from_camera;
#endif
void main() {
#ifdef HEADLIGHT
    from_camera = position - camera;
#endif
#ifdef TEXTURED
    uv = corner_uv;
#endif
#ifdef COLORED
    rgb = corner_rgb;
#endif
    gl_Position = clip_from_mesh * vec4(position, 1.0);
}
