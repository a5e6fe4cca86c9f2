/* Numbers of several cells at once: what a kernel computes with in place of a `double`. */
#ifndef SHELLMB_LANES
#define SHELLMB_LANES
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef long mask __attribute__((vector_size(8 * LANES)));
typedef void kernel_of_lanes(lanes *restrict, const lanes *restrict, const double *restrict,
                             const lanes *restrict);

/* added to a number that all cells have, it makes one of each */
static const lanes ZERO;

static inline lanes choose(mask where, lanes a, lanes b)
{
    return (lanes)((where & (mask)a) | (~where & (mask)b));
}

#define OF_ONE(f)                                                                                  \
    static inline lanes lanes_##f(lanes x)                                                         \
    {                                                                                              \
        for (int i = 0; i < LANES; ++i)                                                            \
            x[i] = f(x[i]);                                                                        \
        return x;                                                                                  \
    }
#define OF_TWO(f)                                                                                  \
    static inline lanes lanes_##f(lanes x, lanes y)                                                \
    {                                                                                              \
        for (int i = 0; i < LANES; ++i)                                                            \
            x[i] = f(x[i], y[i]);                                                                  \
        return x;                                                                                  \
    }
OF_ONE(sqrt)
OF_ONE(fabs)
OF_ONE(sin)
OF_ONE(cos)
OF_ONE(tan)
OF_ONE(asin)
OF_ONE(acos)
OF_ONE(atan)
OF_ONE(sinh)
OF_ONE(cosh)
OF_ONE(tanh)
OF_ONE(exp)
OF_ONE(log)
OF_ONE(erf)
OF_TWO(pow)
OF_TWO(atan2)
OF_TWO(fmin)
OF_TWO(fmax)

/* One cell alone, in all lanes: for DOLFINx. The sizes are those of A, w and x. */
static inline void alone(kernel_of_lanes *kernel, const int sizes[3], double *A, const double *w,
                         const double *c, const double *x)
{
    lanes *work = aligned_alloc(sizeof(lanes), sizeof(lanes) * (sizes[0] + sizes[1] + sizes[2]));
    lanes *all_w = work + sizes[0], *all_x = all_w + sizes[1];
    memset(work, 0, sizeof(lanes) * sizes[0]);
    for (int i = 0; i < sizes[1]; ++i)
        all_w[i] = ZERO + w[i];
    for (int i = 0; i < sizes[2]; ++i)
        all_x[i] = ZERO + x[i];
    kernel(work, all_w, c, all_x);
    for (int i = 0; i < sizes[0]; ++i)
        A[i] += work[i][0];
    free(work);
}
#endif
