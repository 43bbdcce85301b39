/* The simulated loop in C, for comparison with `benches/loop.rs`: the same plant, noise and controller, and nothing else.
 *
 * Standard input: ticks; the lag of the amplifier; the number of modes, each with A (four numbers), current, set-point and force
 * (two each), output, floor; the number of floor lines, each with frequency (Hz), damping ratio, RMS (m/s^2), period (s); noise and
 * quantum of the probe (m); the number of sections, each with b0 b1 b2 a1 a2. Standard output: seconds, and the last position, so
 * that no work is optimised away.
 */
#define _GNU_SOURCE
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { MAX = 64 };

typedef struct { double a[4], current[2], setpoint[2], force[2], output, floor, x[2]; } mode;
typedef struct { double b[3], a[2], x[2]; } section;
typedef struct { unsigned __int128 state, increment; double spare; int has_spare; } gaussian;
typedef struct { double f[4], l[3], x[2]; gaussian noise; } line;

static double number(void) {
    double value;
    if (scanf("%lf", &value) != 1) exit(2);
    return value;
}

/* PCG XSL RR 128/64 (M. O'Neill, HMC-CS-2014-0905). */
static uint64_t bits(gaussian *g) {
    const unsigned __int128 multiplier = (unsigned __int128)2549297995355413924ULL << 64 | 4865540595714422341ULL;
    g->state = g->state * multiplier + g->increment;
    unsigned turn = (unsigned)(g->state >> 122);
    uint64_t folded = (uint64_t)(g->state >> 64) ^ (uint64_t)g->state;
    return folded >> turn | folded << (-turn & 63);
}

static double uniform(gaussian *g) { return (double)((bits(g) >> 11) + 1) * 0x1p-53; }

/* Box-Muller. */
static double normal(gaussian *g) {
    if (g->has_spare) {
        g->has_spare = 0;
        return g->spare;
    }
    double sine, cosine, radius = sqrt(-2.0 * log(uniform(g)));
    sincos(2.0 * M_PI * uniform(g), &sine, &cosine);
    g->spare = radius * sine;
    g->has_spare = 1;
    return radius * cosine;
}

static gaussian seeded(uint64_t seed) {
    gaussian g = {seed * 0x9e3779b97f4a7c15ULL, seed << 1 | 1, 0.0, 0};
    return g;
}

/* The matrices of a line to first order of the damping: their values do not matter here. */
static line floor_line(uint64_t seed) {
    double w = 2.0 * M_PI * number(), damping = number(), rms = number(), period = number();
    double decay = exp(-damping * w * period), c = decay * cos(w * period), s = decay * sin(w * period);
    double gain = rms * sqrt(1.0 - decay * decay);
    line l = {{c, s, -s, c}, {gain, 0.0, gain}, {0.0, 0.0}, seeded(seed)};
    return l;
}

static double next(line *l) {
    double acceleration = l->x[1], n0 = normal(&l->noise), n1 = normal(&l->noise);
    double p = l->f[0] * l->x[0] + l->f[1] * l->x[1] + l->l[0] * n0;
    l->x[1] = l->f[2] * l->x[0] + l->f[3] * l->x[1] + l->l[1] * n0 + l->l[2] * n1;
    l->x[0] = p;
    return acceleration;
}

static double update(section *s, double x) {
    double y = s->b[0] * x + s->x[0];
    s->x[0] = s->b[1] * x - s->a[0] * y + s->x[1];
    s->x[1] = s->b[2] * x - s->a[1] * y;
    return y;
}

int main(void) {
    static mode modes[MAX];
    static line lines[MAX];
    static section sections[MAX];
    long ticks = (long)number();
    double lag = number();
    int mode_count = (int)number();
    if (mode_count > MAX) return 2;
    for (mode *m = modes; m < modes + mode_count; m++) {
        double *fields[] = {m->a, m->current, m->setpoint, m->force};
        int lengths[] = {4, 2, 2, 2};
        for (int k = 0; k < 4; k++)
            for (int i = 0; i < lengths[k]; i++) fields[k][i] = number();
        m->output = number();
        m->floor = number();
    }
    int line_count = (int)number();
    if (line_count > MAX) return 2;
    for (int i = 0; i < line_count; i++) lines[i] = floor_line((uint64_t)i + 2);
    double noise = number(), quantum = number();
    int section_count = (int)number();
    if (section_count > MAX) return 2;
    for (section *s = sections; s < sections + section_count; s++) {
        for (int i = 0; i < 3; i++) s->b[i] = number();
        for (int i = 0; i < 2; i++) s->a[i] = number();
    }

    gaussian probe = seeded(1);
    double current = 0.0, command = 0.0, position = 0.0;
    struct timespec begin, end;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    for (long tick = 0; tick < ticks; tick++) {
        double acceleration = 0.0, output = 0.0;
        for (int i = 0; i < line_count; i++) acceleration += next(&lines[i]);
        for (mode *m = modes; m < modes + mode_count; m++) {
            double force = -acceleration * m->floor, x0 = m->x[0], x1 = m->x[1];
            for (int i = 0; i < 2; i++)
                m->x[i] = m->a[2 * i] * x0 + m->a[2 * i + 1] * x1 + m->current[i] * current
                    + m->setpoint[i] * command + m->force[i] * force;
            output += m->output * m->x[0];
        }
        current = command + (current - command) * lag;
        position = output + noise * normal(&probe);
        if (quantum > 0.0) position = round(position / quantum) * quantum;
        command = -position * 1e6;
        for (section *s = sections; s < sections + section_count; s++) command = update(s, command);
    }
    clock_gettime(CLOCK_MONOTONIC, &end);
    printf("%.9f %g\n", (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec), position);
    return 0;
}
