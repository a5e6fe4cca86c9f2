/* Bases of nodes that carry one director or three: what increments and forces are tangent to, and
 * what makes multipliers of forces (directors.py, directorpath.py). All matrices are row-major. */
#include <math.h>

enum { MOST_ROWS = 6, MOST_SIZE = 9, PATH_STATES = 7, PATH_TANGENT = 7, PATH_BASES = 11 };

static const int PAIRS[MOST_ROWS][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
static const double NOTHING = 0.0 / 0.0;

/* Two orthonormal vectors across a vector, (3, 2): J. R. Frisvad's basis, as mended by T. Duff et
 * al., J. Comput. Graph. Tech. 6 (2017) 1-8. */
static void across(const double *d, double *out)
{
    double size = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    double x = d[0] / size, y = d[1] / size, z = d[2] / size;
    double sign = copysign(1.0, z), a = -1.0 / (sign + z), b = x * y * a;
    out[0] = 1 + sign * x * x * a;
    out[1] = b;
    out[2] = sign * b;
    out[3] = sign + y * y * a;
    out[4] = -sign * x;
    out[5] = -y;
}

static void cross(const double *a, const double *b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Changes of three directors that keep their products, (9, 3): directors M and their changes D have
 * a skew `M D^T`. */
static void rotations(const double *d, double *out)
{
    double dual[3][3], volume = 0.0;
    for (int k = 0; k < 3; ++k)
        cross(d + 3 * ((k + 1) % 3), d + 3 * ((k + 2) % 3), dual[k]);
    for (int i = 0; i < 3; ++i)
        volume += d[i] * dual[0][i];
    /* neither zero nor beyond all numbers */
    volume = fabs(volume) > 0.0 && fabs(volume) < INFINITY ? volume : NOTHING;
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i) {
            double *row = out + 9 * k + 3 * i;
            row[k] = volume == volume ? 0.0 : NOTHING;
            row[(k + 2) % 3] = -dual[(k + 1) % 3][i] / volume;
            row[(k + 1) % 3] = dual[(k + 2) % 3][i] / volume;
        }
}

static void tangent_of(int directors, const double *d, double *out)
{
    (directors == 1 ? across : rotations)(d, out);
}

/* Derivative of the constraints, (rows, 3 directors); returns the number of rows. */
static ALWAYS int constraint_rows(int directors, const double *d, double *C)
{
    int rows = directors == 1 ? 1 : MOST_ROWS, n = 3 * directors;
    memset(C, 0, sizeof(double) * rows * n);
    for (int row = 0; row < rows; ++row) {
        int a = PAIRS[row][0], b = PAIRS[row][1];
        memcpy(C + row * n + 3 * a, d + 3 * b, sizeof(double) * 3);
        memcpy(C + row * n + 3 * b, d + 3 * a, sizeof(double) * 3);
    }
    return rows;
}

/* C = A B of shapes (m, k) and (k, n), times a factor. */
static ALWAYS void small_product(int m, int k, int n, double factor, const double *A, const double *B,
                          double *C)
{
    for (int i = 0; i < m; ++i)
        for (int j = 0; j < n; ++j) {
            double sum = 0.0;
            for (int l = 0; l < k; ++l)
                sum += A[i * k + l] * B[l * n + j];
            C[i * n + j] = factor * sum;
        }
}

/* Numbers of two places, so many of each, take each other's. */
static ALWAYS void swap(int count, double *a, double *b)
{
    for (int j = 0; j < count; ++j) {
        double kept = a[j];
        a[j] = b[j];
        b[j] = kept;
    }
}

/* A X = B, (n, n) and (n, m): B becomes X and A is lost; no number where A is singular. By pivots in
 * columns: LAPACK takes ten times as long for six unknowns. */
static ALWAYS void small_solve(int n, int m, double *A, double *B)
{
    for (int k = 0; k < n; ++k) {
        int pivot = k;
        for (int i = k + 1; i < n; ++i)
            if (fabs(A[i * n + k]) > fabs(A[pivot * n + k]))
                pivot = i;
        swap(n, A + k * n, A + pivot * n);
        swap(m, B + k * m, B + pivot * m);
        double one = fabs(A[k * n + k]) > 0.0 ? 1 / A[k * n + k] : NOTHING;
        for (int i = 0; i < n; ++i) {
            double factor = A[i * n + k] * one;
            if (i == k)
                continue;
            for (int j = k + 1; j < n; ++j)
                A[i * n + j] -= factor * A[k * n + j];
            for (int j = 0; j < m; ++j)
                B[i * m + j] -= factor * B[k * m + j];
        }
        for (int j = k + 1; j < n; ++j)
            A[k * n + j] *= one;
        for (int j = 0; j < m; ++j)
            B[k * m + j] *= one;
    }
}

/* `C^T (C C^T)^-1` of rows (c, n), shape (n, c). */
static ALWAYS void small_inverse(int c, int n, const double *C, double *out)
{
    double squares[MOST_ROWS * MOST_ROWS], turned[MOST_ROWS * MOST_SIZE];
    for (int i = 0; i < c; ++i)
        for (int j = 0; j < c; ++j) {
            double sum = 0.0;
            for (int l = 0; l < n; ++l)
                sum += C[i * n + l] * C[j * n + l];
            squares[i * c + j] = sum;
        }
    memcpy(turned, C, sizeof(double) * c * n);
    small_solve(c, n, squares, turned);
    for (int i = 0; i < c; ++i)
        for (int j = 0; j < n; ++j)
            out[j * c + i] = turned[i * n + j];
}

/* States of a node's directors: so many weighted sums. */
static ALWAYS void states_of(int count, const PathNodes *p, int node, int n, double (*at)[MOST_SIZE])
{
    for (int i = 0; i < n; ++i) {
        int64_t dof = p->dofs[node * n + i];
        double given[4], zero = p->reference[node * n + i];
        for (int k = 0; k < 4; ++k)
            given[k] = p->values[k][dof] + (k % 2 ? 0.0 : zero);
        for (int k = 0; k < count; ++k) {
            const double *w = p->weights + 4 * k;
            at[k][i] = w[0] * given[0] + w[1] * given[1] + w[2] * given[2] + w[3] * given[3];
        }
    }
}

/* Bases of nodes: tangent at the first state, where forces act, and at the second one, and `(C^T)^+` of
 * the first; none of nodes that are held. */
void bases(int nodes, int directors, const PathNodes *p, const unsigned char *held, double **out)
{
    int n = 3 * directors, m = directors == 1 ? 2 : 3, c = directors == 1 ? 1 : MOST_ROWS;
    double at[2][MOST_SIZE], C[MOST_ROWS * MOST_SIZE];
    for (int node = 0; node < nodes; ++node) {
        if (held[node])
            continue;
        states_of(2, p, node, n, at);
        for (int k = 0; k < 2; ++k)
            tangent_of(directors, at[k], out[k] + node * n * m);
        constraint_rows(directors, at[0], C);
        small_inverse(c, n, C, out[2] + node * n * c);
    }
}

/* For one or three directors: sizes are constants for the compiler, which unrolls all loops.
 * Bases of nodes over a step that is quadratic in time, of ends and of velocities: increments, those
 * of velocities with the ends, tests and forces in own equations and in the others'. Tests are
 * [T_x a + P_x beta; T_m b + P_m gamma] with beta + D (T_m b + P_m gamma) = 0 and
 * gamma + s (T_x a + P_x beta) = 0; forces f = C_x^T l + C_s^T k, g = C_D^T l + C_m^T k have, with
 * their products with P_x and P_m, the transposed matrices. */
static ALWAYS void path_bases_of(int nodes, int directors, const PathNodes *p, const unsigned char *held,
                double **out)
{
    enum { R = MOST_ROWS, S = MOST_SIZE };
    int n = 3 * directors, m = directors == 1 ? 2 : 3, c = directors == 1 ? 1 : R;
    double at[PATH_STATES][S], C[PATH_STATES][R * S], T[2][S * 3], P[3][S * R], seen[2][R * R], sees[2][R * 3];
    for (int node = 0; node < nodes; ++node) {
        double *to[PATH_BASES];
        for (int k = 0; k < PATH_BASES; ++k) {
            int width = k < PATH_TANGENT ? m : c;
            to[k] = out[k] + node * n * width;
            memset(to[k], 0, sizeof(double) * n * width);
        }
        if (held[node])
            continue;
        states_of(PATH_STATES, p, node, n, at);
        for (int k = 1; k < PATH_STATES; ++k)
            constraint_rows(directors, at[k], C[k]);
        tangent_of(directors, at[0], to[0]);
        tangent_of(directors, at[1], to[1]);
        small_inverse(c, n, C[1], P[2]);
        small_product(c, n, m, -1.0, C[2], to[0], sees[0]);
        small_product(n, c, m, 1.0, P[2], sees[0], to[2]);
        /* of the ends with the chord, and of the velocities with the mean velocity */
        for (int k = 0; k < 2; ++k) {
            tangent_of(directors, at[3 + k], T[k]);
            small_inverse(c, n, C[3 + k], P[k]);
        }
        for (int k = 0; k < 2; ++k) {
            small_product(c, n, c, 1.0, C[5 + k], P[1 - k], seen[k]);
            small_product(c, n, m, 1.0, C[5 + k], T[1 - k], sees[k]);
        }
        for (int k = 0; k < 2; ++k) {
            /* own directions, the others', and the inverse itself */
            double A[R * R], own[R * 3], sides[R * (6 + R)];
            int width = 2 * m + c;
            small_product(c, c, c, -1.0, seen[k], seen[1 - k], A);
            small_product(c, c, m, 1.0, seen[k], sees[1 - k], own);
            for (int i = 0; i < c; ++i) {
                A[i * c + i] += 1.0;
                double *side = sides + i * width;
                for (int j = 0; j < m; ++j) {
                    side[j] = own[i * m + j];
                    side[m + j] = -sees[k][i * m + j];
                }
                for (int j = 0; j < c; ++j)
                    side[2 * m + j] = i == j;
            }
            small_solve(c, width, A, sides);
            double *left = to[3 + 2 * k], *left_other = to[4 + 2 * k], turned[S * R];
            double *forces = to[PATH_TANGENT + 2 * k], *others = to[PATH_TANGENT + 3 - 2 * k];
            memcpy(left, T[k], sizeof(double) * n * m);
            small_product(n, c, c, -1.0, P[1 - k], seen[1 - k], turned);
            for (int i = 0; i < n; ++i)
                for (int l = 0; l < c; ++l) {
                    const double *side = sides + l * width;
                    double by = P[k][i * c + l], across = turned[i * c + l];
                    for (int j = 0; j < m; ++j) {
                        left[i * m + j] += by * side[j];
                        left_other[i * m + j] += by * side[m + j];
                    }
                    for (int j = 0; j < c; ++j) {
                        forces[i * c + j] += by * side[2 * m + j];
                        others[i * c + j] += across * side[2 * m + j];
                    }
                }
        }
    }
}

void path_bases(int nodes, int directors, const PathNodes *p, const unsigned char *held,
                double **out)
{
    if (directors == 1)
        path_bases_of(nodes, 1, p, held, out);
    else
        path_bases_of(nodes, 3, p, held, out);
}
