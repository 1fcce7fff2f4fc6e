// With TEXTURED, COLORED, or both; CUT_OUT needs TEXTURED; HEADLIGHT is a lamp at the camera.
uniform vec3 base_rgb;
#ifdef TEXTURED
uniform sampler2D image;
uniform float level_bias;
in vec2 uv;
#endif
#ifdef COLORED
in vec3 rgb;
#endif
#ifdef HEADLIGHT
uniform float floor_share;  // of the light, where a surface is seen edge-on
in vec3 from_camera;
#endif
out vec4 color;
void main() {
    color = vec4(base_rgb, 1.0);
#ifdef COLORED
    color.rgb *= rgb;
#endif
#ifdef TEXTURED
    vec4 texel = texture(image, uv, level_bias);
    color.rgb *= texel.rgb;
#endif
#ifdef HEADLIGHT
    // Before anything is discarded: derivatives need all four samples of a block.
    vec3 normal = cross(dFdx(from_camera), dFdy(from_camera));
    float cosine = abs(dot(normal, from_camera));
    cosine /= max(length(normal) * length(from_camera), 1e-30);
    color.rgb *= mix(floor_share, 1.0, min(cosine, 1.0));
#endif
#ifdef CUT_OUT
    if (texel.a < 0.5) discard;
#endif
}
