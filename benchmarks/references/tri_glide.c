/* The closed form of the tri-glide in a plain loop, one pose after the other. Arrays have shape
   (n, 3). Impossible poses give NaN by the square root; nothing else is checked. */
#include <math.h>
#include <stddef.h>

/* constants: x, y and squared length of each arm. */
void inverse(size_t n, const double *constants, const double *positions, double *heights)
{
    const double x1 = constants[0], y1 = constants[1], b1 = constants[2];
    const double x2 = constants[3], y2 = constants[4], b2 = constants[5];
    const double x3 = constants[6], y3 = constants[7], b3 = constants[8];
    for (size_t i = 0; i < n; i++) {
        const double x = positions[3 * i], y = positions[3 * i + 1], z = positions[3 * i + 2];
        const double f1x = x1 - x, f1y = y1 - y;
        const double f2x = x2 - x, f2y = y2 - y;
        const double f3x = x3 - x, f3y = y3 - y;
        heights[3 * i] = z + sqrt(b1 - f1x * f1x - f1y * f1y);
        heights[3 * i + 1] = z + sqrt(b2 - f2x * f2x - f2y * f2y);
        heights[3 * i + 2] = z + sqrt(b3 - f3x * f3x - f3y * f3y);
    }
}

void forward(size_t n, const double *constants, const double *heights, double *positions)
{
    const double x1 = constants[0], y1 = constants[1], b1 = constants[2];
    const double x2 = constants[3] - x1, y2 = constants[4] - y1, b2 = constants[5];
    const double x3 = constants[6] - x1, y3 = constants[7] - y1, b3 = constants[8];
    const double area = x2 * y3 - x3 * y2;
    const double ux = y3 / area, uy = -x3 / area, vx = -y2 / area, vy = x2 / area;
    const double k2 = (x2 * x2 + y2 * y2 + b1 - b2) / 2.0;
    const double k3 = (x3 * x3 + y3 * y3 + b1 - b3) / 2.0;
    for (size_t i = 0; i < n; i++) {
        const double h1 = heights[3 * i];
        const double d2 = heights[3 * i + 1] - h1, d3 = heights[3 * i + 2] - h1;
        const double e2 = k2 + 0.5 * d2 * d2, e3 = k3 + 0.5 * d3 * d3;
        const double px = ux * e2 + vx * e3, py = uy * e2 + vy * e3;
        const double mx = ux * d2 + vx * d3, my = uy * d2 + vy * d3;
        const double norm = 1.0 + mx * mx + my * my, dot = px * mx + py * my;
        const double root = sqrt(dot * dot - norm * (px * px + py * py - b1));
        const double w = (dot - root) / norm;
        positions[3 * i] = x1 + px - mx * w;
        positions[3 * i + 1] = y1 + py - my * w;
        positions[3 * i + 2] = h1 + w;
    }
}
