precision highp float;
in vec3 shade;
out vec4 pixel;
void main()
{
    pixel = vec4(sqrt(clamp(shade, 0.0, 1.0)), 1.0); /* the square root stands for sRGB, as in the daemon's pictures */
}
