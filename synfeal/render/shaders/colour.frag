// With TEXTURED, COLOURED, or both; CUT_OUT needs TEXTURED.
uniform vec3 base_rgb;
#ifdef TEXTURED
uniform sampler2D image;
uniform float level_bias;
in vec2 uv;
#endif
#ifdef COLOURED
in vec3 rgb;
#endif
out vec4 colour;
void main() {
    colour = vec4(base_rgb, 1.0);
#ifdef COLOURED
    colour.rgb *= rgb;
#endif
#ifdef TEXTURED
    vec4 texel = texture(image, uv, level_bias);
    colour.rgb *= texel.rgb;
#endif
#ifdef CUT_OUT
    if (texel.a < 0.5) discard;
#endif
}
