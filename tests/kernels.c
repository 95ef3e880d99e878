/* The loops of our solvers in C, row by row as they have them: see kernels.py.

   c rows on 3 vertices each: v (c, 3), g (c, 3) the coefficients of G; x, y (n, 3). */
#include <math.h>

static void row(const int *v, const double *g, const double *x, double *y)
{
    y[0] = y[1] = y[2] = 0;
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++)
            y[j] += g[k] * x[3 * v[k] + j];
}

static void add(const int *v, const double *g, double s, const double *y, double *x)
{
    const double z[3] = {s * y[0], s * y[1], s * y[2]};
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++)
            x[3 * v[k] + j] += g[k] * z[j];
}

static double square(const double *y) { return y[0] * y[0] + y[1] * y[1] + y[2] * y[2]; }

void gauss_seidel(long c, const int *v, const double *g, const double *steps, const double *b,
                  const double *l, double *x, long sweeps)
{
    for (long n = 0; n < sweeps; n++) {
        double worst = 0;
        for (long i = 0; i < c; i++) {
            double y[3], bound = b[i];
            row(v + 3 * i, g + 3 * i, x, y);
            const double s = square(y);
            if (s <= bound * bound && s >= (bound = l[i]) * bound)
                continue;
            const double length = sqrt(s), excess = length - bound;
            worst = fmax(worst, fabs(excess));
            if (length > 0)
                add(v + 3 * i, steps + 3 * i, -excess / length, y, x);
        }
        if (worst < 0)
            return;
    }
}

void xpbd(long c, const int *v, const double *g, const double *moves, const double *L,
          const double *b, double *x, double *l, long sweeps)
{
    for (long n = 0; n < sweeps; n++) {
        double worst = 0;
        for (long i = 0; i < c; i++) {
            double y[3];
            row(v + 3 * i, g + 3 * i, x, y);
            const double s = square(y), limit = b[i] * b[i];
            if (L[i] == 0 || (s <= limit && !(l[i] > 0)))
                continue;
            worst = fmax(worst, (s - limit) / (2 * b[i]));
            const double change = fmax((s - limit) / (4 * s * L[i]), -l[i]);
            l[i] += change;
            add(v + 3 * i, moves + 3 * i, -2 * change, y, x);
        }
        if (worst < 0)
            return;
    }
}

void dykstra(long c, const int *v, const double *g, const double *moves, const double *steps,
             const double *b, double *x, double *Y, double *norms, long sweeps)
{
    for (long n = 0; n < sweeps; n++)
        for (long i = 0; i < c; i++) {
            double z[3], back[3], *old = Y + 3 * i;
            if (steps[i] == 0)
                continue;
            row(v + 3 * i, g + 3 * i, x, z);
            for (int j = 0; j < 3; j++)
                z[j] = old[j] + steps[i] * z[j];
            const double s = sqrt(square(z)), t = steps[i] * b[i], f = s > t ? 1 - t / s : 0;
            norms[i] = f * s;
            if (norms[i] == 0 && old[0] == 0 && old[1] == 0 && old[2] == 0)
                continue;
            for (int j = 0; j < 3; j++) {
                back[j] = old[j] - f * z[j];
                old[j] = f * z[j];
            }
            add(v + 3 * i, moves + 3 * i, 1, back, x);
        }
}

void balls(long c, const double *v, const double *b, double *z)
{
    for (long i = 0; i < c; i++) {
        const double s = square(v + 3 * i), f = s > b[i] * b[i] ? b[i] / sqrt(s) : 1;
        for (int j = 0; j < 3; j++)
            z[3 * i + j] = f * v[3 * i + j];
    }
}

void pull(long c, const int *v, const double *g, const double *w, const double *y, const double *z,
          const double *start, double *x)
{
    for (long i = 0; i < c; i++) {
        double r[3];
        for (int j = 0; j < 3; j++)
            r[j] = w[i] * (2 * z[3 * i + j] - y[3 * i + j] - start[3 * i + j]);
        add(v + 3 * i, g + 3 * i, 1, r, x);
    }
}

void evaluate(long n, long c, const int *v, const double *g, const double *pulls, const double *M,
              const double *b, const double *rho, const double *t, const double *Y,
              const double *x, double *lengths, double *along, double *Y_new, double *gradient,
              double *values)
{
    double value = 0, moved = 0;
    for (long k = 0; k < n; k++)
        for (int j = 0; j < 3; j++) {
            const double apart = x[3 * k + j] - t[3 * k + j];
            gradient[3 * k + j] = M[k] * apart;
            value += 0.5 * gradient[3 * k + j] * apart;
        }
    for (long i = 0; i < c; i++) {
        double z[3];
        row(v + 3 * i, g + 3 * i, x, z);
        for (int j = 0; j < 3; j++)
            z[j] += Y[3 * i + j] / rho[i];
        const double s = sqrt(square(z)), beyond = rho[i] * fmax(0, s - b[i]);
        lengths[i] = s;
        value += 0.5 * beyond * beyond / rho[i];
        for (int j = 0; j < 3; j++) {
            along[3 * i + j] = s > 0 ? z[j] / s : 0;
            Y_new[3 * i + j] = z[j] = beyond * along[3 * i + j];
            const double apart = z[j] - Y[3 * i + j];
            moved += 0.5 * apart * apart / rho[i];
        }
        if (s > b[i])
            add(v + 3 * i, pulls + 3 * i, 1, z, gradient);
    }
    values[0] = value;
    values[1] = moved;
}

void product(long n, long c, const int *v, const double *g, const double *pulls, const double *M,
             const double *b, const double *rho, const double *lengths, const double *along,
             const double *p, double *out)
{
    for (long k = 0; k < n; k++)
        for (int j = 0; j < 3; j++)
            out[3 * k + j] = M[k] * p[3 * k + j];
    for (long i = 0; i < c; i++) {
        if (lengths[i] <= b[i])
            continue;
        double h[3];
        const double *u = along + 3 * i, f = 1 - b[i] / lengths[i];
        row(v + 3 * i, g + 3 * i, p, h);
        const double a = (1 - f) * (u[0] * h[0] + u[1] * h[1] + u[2] * h[2]);
        for (int j = 0; j < 3; j++)
            h[j] = rho[i] * (f * h[j] + a * u[j]);
        add(v + 3 * i, pulls + 3 * i, 1, h, out);
    }
}
