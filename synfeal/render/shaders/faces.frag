// Number of the triangle at the pixel's centre, from 1, as two halves that single precision holds.
uniform int first_face;
#ifdef CUT_OUT
uniform sampler2D image;
in vec2 uv;
#endif
out vec2 halves;
void main() {
#ifdef CUT_OUT
    if (textureLod(image, uv, 0.0).a < 0.5) discard;
#endif
    int number = first_face + gl_PrimitiveID + 1;
    halves = vec2(number >> 16, number & 65535);
}
