// Distance along the optical axis at the pixel's centre: not multi-sampled, not rounded.
#ifdef CUT_OUT
uniform sampler2D image;
in vec2 uv;
#endif
out float depth_m;
void main() {
#ifdef CUT_OUT
    if (textureLod(image, uv, 0.0).a < 0.5) discard;
#endif
    depth_m = 1.0 / gl_FragCoord.w;
}
