// With TEXTURED, COLOURED, or both.
uniform mat4 clip_from_mesh;
in vec3 position;
#ifdef TEXTURED
in vec2 corner_uv;
out vec2 uv;
#endif
#ifdef COLOURED
in vec3 corner_rgb;
out vec3 rgb;
#endif
void main() {
#ifdef TEXTURED
    uv = corner_uv;
#endif
#ifdef COLOURED
    rgb = corner_rgb;
#endif
    gl_Position = clip_from_mesh * vec4(position, 1.0);
}
