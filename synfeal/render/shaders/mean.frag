// The mean of FACTOR x FACTOR samples: a constant, so that the compiler unrolls the loop, which
// halves the time.
uniform sampler2D samples;
out vec4 color;
void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * FACTOR;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < FACTOR; y++)
        for (int x = 0; x < FACTOR; x++)
            sum += texelFetch(samples, first + ivec2(x, y), 0);
    color = sum / float(FACTOR * FACTOR);
}
