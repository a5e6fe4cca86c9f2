/* Numbers of LANES cells side by side, and those of each by itself: squares of LANES by LANES
 * numbers are transposed in the processor's vectors.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Numbers of several cells side by side; the same anywhere in the memory; places in such. */
typedef double lanes __attribute__((vector_size(8 * LANES), may_alias));
typedef double anywhere __attribute__((vector_size(8 * LANES), may_alias, aligned(8)));
typedef int64_t order __attribute__((vector_size(8 * LANES)));

#define ALWAYS inline __attribute__((always_inline))

/* A loop without one, whose vectors stay in registers. */
#define EACH(i) _Pragma("GCC unroll 8") for (int i = 0; i < LANES; ++i)

/* Numbers l of vectors k become numbers k of vectors l: squares of n by n numbers beside the diagonal of
 * squares twice as large change places. */
static ALWAYS void transpose(lanes *v)
{
    order at;
    EACH(l) at[l] = l;
    _Pragma("GCC unroll 3") for (int n = 1; n < LANES; n *= 2)
    {
        /* from which of two vectors, one behind the other, each number of the first one comes */
        order from = at + (at & n) * (LANES / n - 1);
        EACH(i) if (!(i & n))
        {
            lanes a = v[i], b = v[i + n];
            v[i] = __builtin_shuffle(a, b, from);
            v[i + n] = __builtin_shuffle(a, b, from + n);
        }
    }
}

/* Whether places follow one another. */
static int in_line(int count, const int *place)
{
    for (int q = 1; q < count; ++q)
        if (place[q] != place[0] + q)
            return 0;
    return 1;
}

/* Matrices of `count` of the cells side by side, (rows, columns, LANES), each put at its own `out`
 * (row-major, `stride` columns), which is `apart` from that before, or added there. */
static void take_apart(int rows, int columns, const lanes *from, const int *row_place,
                       const int *column_place, int count, int adds, double *out, size_t apart,
                       int stride)
{
    int squares[columns];
    for (int j = 0; j < columns; ++j)
        squares[j] = j + LANES <= columns && in_line(LANES, column_place + j);
    /* row by row, so that what is written follows what was written before */
    for (int i = 0; i < rows; ++i, from += columns) {
        double *row = out + (size_t)row_place[i] * stride;
        for (int j = 0; j < columns; ++j) {
            double *to = row + column_place[j];
            if (squares[j]) {
                lanes v[LANES];
                EACH(q) v[q] = from[j + q];
                transpose(v);
                EACH(l) if (l < count)
                {
                    anywhere *at = (anywhere *)(to + l * apart);
                    if (adds)
                        v[l] += *at;
                    *at = v[l];
                }
                j += LANES - 1;
                continue;
            }
            for (int l = 0; l < count; ++l)
                to[l * apart] = from[j][l] + (adds ? to[l * apart] : 0.0);
        }
    }
}

/* Numbers of LANES cells, (LANES, size), side by side. */
static void put_together(int size, const double *from, double *to)
{
    int i = 0;
    for (; i + LANES <= size; i += LANES) {
        lanes v[LANES];
        EACH(l) v[l] = *(const anywhere *)(from + (size_t)l * size + i);
        transpose(v);
        EACH(q) ((lanes *)to)[i + q] = v[q];
    }
    for (; i < size; ++i)
        for (int l = 0; l < LANES; ++l)
            to[i * LANES + l] = from[(size_t)l * size + i];
}
