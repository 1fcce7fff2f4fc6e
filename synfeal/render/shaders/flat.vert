#version 330 core
// Names and locations are those that pyrender sets.
layout(location = 0) in vec3 position;
#ifdef TEXCOORD_0_LOC
layout(location = TEXCOORD_0_LOC) in vec2 texcoord_0;
out vec2 uv_0;
#endif
#ifdef COLOR_0_LOC
layout(location = COLOR_0_LOC) in vec4 color_0;
out vec4 color_multiplier;
#endif
uniform mat4 M;
uniform mat4 V;
uniform mat4 P;
out vec3 from_camera;

void main()
{
    vec4 in_camera = V * (M * vec4(position, 1.0));
    from_camera = in_camera.xyz;
    gl_Position = P * in_camera;
#ifdef TEXCOORD_0_LOC
    uv_0 = texcoord_0;
#endif
#ifdef COLOR_0_LOC
    color_multiplier = color_0;
#endif
}
