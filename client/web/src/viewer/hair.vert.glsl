precision highp float;
precision highp sampler3D;
precision highp sampler2D;

/* A ribbon a strand that faces the camera: two corners a vertex, 2 i and 2 i + 1 of vertex i; strands of one
 * vertex count. Points and what they are coloured by stand in textures, three texels and one of a vertex in rows
 * of ROW vertices, so that an edit uploads each point once and nothing is drawn an instance at a time. */
uniform sampler2D points, values;

uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 cameraPosition;
uniform int vertices;
uniform float width;         /* of a hair, metres */
uniform float pixel;         /* metres of a pixel a metre away */
uniform vec3 color, keyDirection, rimDirection;
uniform sampler3D light;     /* how much of the key light arrives; how much of the surroundings is seen */
uniform vec3 lightOrigin, lightSize;
uniform bool lit;
uniform bool coloured;
uniform sampler2D palette;
uniform vec2 range;          /* values at the palette's ends */

out vec3 shade;

float hash(uint x)
{
    x ^= x >> 16; x *= 0x7feb352du; x ^= x >> 15; x *= 0x846ca68bu; x ^= x >> 16;
    return float(x >> 8) / 16777216.0;
}

float sine(float cosine) { return sqrt(max(0.0, 1.0 - cosine * cosine)); }

/* Kajiya and Kay 1989 with Marschner's second, coloured highlight: the daemon's pictures have the same */
vec3 lightOn(vec3 tangent, vec3 towards, vec3 view, vec3 own, float shift)
{
    float across = dot(tangent, normalize(towards + view)), around = sine(dot(tangent, towards));
    float first = pow(sine(across + 0.06 + shift), 96.0), second = pow(sine(across - 0.12 + shift), 16.0);
    return 0.62 * around * own + vec3(0.085 * first) + 0.75 * second * own;
}

/* Hair as a map: the palette's colour, with just as much light that shape still reads. */
vec3 mapped(float value, vec3 tangent, vec2 seen)
{
    bool known = value == value;
    vec3 own = known ? texture(palette, vec2(clamp((value - range.x) / (range.y - range.x), 0.002, 0.998), 0.5)).rgb : vec3(0.35);
    float light = 0.45 * seen.y + 0.55 * (0.35 + 0.65 * seen.x) * sine(dot(tangent, keyDirection));
    return own * own * (0.25 + 0.9 * light);
}

vec3 shadeAt(vec3 at, vec3 tangent, uint strand, float value)
{
    float bright = 0.72 + 0.56 * hash(strand * 3u), warm = 0.12 * (hash(strand * 3u + 1u) - 0.5);
    float shift = 0.1 * (hash(strand * 3u + 2u) - 0.5);
    vec3 own = color * bright * (1.0 + warm * vec3(1.0, 0.0, -1.0)), view = normalize(cameraPosition - at);
    vec2 seen = lit ? texture(light, (at - lightOrigin) / lightSize).rg : vec2(1.0, 0.7);
    if (coloured) return mapped(value, tangent, seen);
    float open = seen.y * seen.y;
    return vec3(0.60, 0.64, 0.70) * own * (0.06 + 0.94 * open)
         + vec3(1.55, 1.48, 1.36) * (0.03 + 0.97 * seen.x) * lightOn(tangent, keyDirection, view, own, shift)
         + vec3(0.75, 0.83, 0.95) * open * seen.y * lightOn(tangent, rimDirection, view, own, shift);
}

vec3 pointAt(int i)
{
    ivec2 at = ivec2(3 * (i % ROW), i / ROW);
    return vec3(texelFetch(points, at, 0).r, texelFetch(points, at + ivec2(1, 0), 0).r, texelFetch(points, at + ivec2(2, 0), 0).r);
}

void main()
{
    int i = gl_VertexID / 2, along = i % vertices;
    uint strand = uint(i / vertices);
    bool root = along == 0, tip = along == vertices - 1;
    vec3 at = pointAt(i), bend = (tip ? at : pointAt(i + 1)) - (root ? at : pointAt(i - 1));
    float size = length(bend);
    vec3 tangent = size > 0.0 ? bend / size : vec3(0.0, -1.0, 0.0);
    vec3 view = cameraPosition - at, side = cross(tangent, view);
    float across = length(side), taper = tip ? 0.35 : 1.0;
    float half_width = 0.5 * max(width * taper, pixel * length(view));
    vec3 corner = at + (across > 0.0 ? side / across : vec3(0.0)) * (gl_VertexID % 2 == 0 ? -half_width : half_width);
    gl_Position = projectionMatrix * modelViewMatrix * vec4(corner, 1.0);
    shade = shadeAt(at, tangent, strand, coloured ? texelFetch(values, ivec2(i % ROW, i / ROW), 0).r : 0.0);
}
