precision highp float;
precision highp sampler3D;

/* A ribbon a segment that faces the camera; four corners an instance, strands of one vertex count. */
in vec2 corner;              /* x: 0 or 1 along the segment, y: -1 or 1 across */
in vec3 before, p, q, after; /* the segment p q and the vertices around it */
in float value_p, value_q;   /* what p and q are coloured by */

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

void main()
{
    int along = gl_InstanceID % vertices;
    uint strand = uint(gl_InstanceID / vertices);
    if (along == vertices - 1) { /* from a tip to the next root: nothing */
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
        shade = vec3(0.0);
        return;
    }
    bool tip = corner.x > 0.5;
    vec3 segment = q - p, at = tip ? q : p;
    vec3 bend = tip ? (along == vertices - 2 ? segment : after - p) : (along == 0 ? segment : q - before);
    float size = length(bend);
    vec3 tangent = size > 0.0 ? bend / size : vec3(0.0, -1.0, 0.0);
    vec3 view = cameraPosition - at;
    vec3 side = cross(tangent, view);
    float across = length(side), taper = tip && along == vertices - 2 ? 0.35 : 1.0;
    float half_width = 0.5 * max(width * taper, pixel * length(view));
    at += (across > 0.0 ? side / across : vec3(0.0)) * corner.y * half_width;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(at, 1.0);
    shade = shadeAt(tip ? q : p, tangent, strand, tip ? value_q : value_p);
}
