"""The shader programs: one source, compiled with the features a part has.

Depth is ``1 / gl_FragCoord.w``, the distance along the optical axis at the pixel's centre, written
to a float image of its own: neither a multi-sampled pixel nor a rounded depth buffer.
"""

from __future__ import annotations

from collections.abc import Collection

HEADER = "#version 330\n"

VERTEX = """
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
"""

COLOUR = """
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
"""

DEPTH = """
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
"""

# One triangle that covers the image.
COVER = """
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1);
}
"""

# The factor is a constant: a loop that the compiler unrolls takes half the time.
MEAN = """
const int FACTOR = %d;
uniform sampler2D samples;
out vec4 colour;
void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * FACTOR;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < FACTOR; y++)
        for (int x = 0; x < FACTOR; x++)
            sum += texelFetch(samples, first + ivec2(x, y), 0);
    colour = sum / float(FACTOR * FACTOR);
}
"""


def with_features(source: str, features: Collection[str]) -> str:
    """The source with each of ``TEXTURED``, ``COLOURED`` and ``CUT_OUT`` that is named switched on.

    ``CUT_OUT`` needs ``TEXTURED``.
    """
    return HEADER + "".join(f"#define {name}\n" for name in sorted(features)) + source
