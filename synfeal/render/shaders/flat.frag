#version 330 core
// Colour, depth along the optical axis in metres, or the number of the triangle, from 1, as two
// halves: whichever is drawn to.
struct Material {
    vec4 base_color_factor;
#ifdef HAS_BASE_COLOR_TEX
    sampler2D base_color_texture;
#endif
};
uniform Material material;
uniform float level_bias;  // added to the mip level
// Share of a lamp's light where a surface is seen edge-on; 1 without a lamp.
uniform float floor_share;
in vec3 from_camera;
uniform int first_face;
#ifdef TEXCOORD_0_LOC
in vec2 uv_0;
#endif
#ifdef COLOR_0_LOC
in vec4 color_multiplier;
#endif
layout(location = 0) out vec4 color;
layout(location = 1) out vec4 depth_m;
layout(location = 2) out vec4 halves;

void main()
{
    color = material.base_color_factor;
    if (floor_share < 1.0) {
        vec3 normal = cross(dFdx(from_camera), dFdy(from_camera));
        float cosine = abs(dot(normal, from_camera));
        cosine /= max(length(normal) * length(from_camera), 1e-30);
        color.rgb *= mix(floor_share, 1.0, min(cosine, 1.0));
    }
#ifdef HAS_BASE_COLOR_TEX
    vec4 texel = texture(material.base_color_texture, uv_0, level_bias);
    if (texel.a < 0.5)
        discard;
    color.rgb *= texel.rgb;
#endif
#ifdef COLOR_0_LOC
    color.rgb *= color_multiplier.rgb;
#endif
    depth_m = vec4(1.0 / gl_FragCoord.w);
    int number = first_face + gl_PrimitiveID + 1;
    halves = vec4(number >> 16, number & 65535, 0, 0);
}
