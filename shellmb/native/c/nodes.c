/* Loops over nodes: directors, and how they are turned by finite rotations. */

/* One director, by `r = d x change / 2` in closed form. */
static void turn_vector(double *d, const double *change)
{
    double along = d[0] * change[0] + d[1] * change[1] + d[2] * change[2], quarter = 0.0;
    double across[3], size = 0.0;
    for (int i = 0; i < 3; ++i) {
        across[i] = change[i] - along * d[i];
        quarter += across[i] * across[i] / 4;
    }
    for (int i = 0; i < 3; ++i) {
        d[i] = ((1 - quarter) * d[i] + across[i]) / (1 + quarter);
        size += d[i] * d[i];
    }
    /* round-off of many updates must not add up */
    for (int i = 0; i < 3; ++i)
        d[i] /= sqrt(size);
}

/* One step of Newton's method from the triple `v` to the nearest orthonormal one: it squares the
 * error. */
static void nearer_triple(const double *v, double *d)
{
    double gram[3][3];
    for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l)
            gram[k][l] = v[3 * k] * v[3 * l] + v[3 * k + 1] * v[3 * l + 1] +
                         v[3 * k + 2] * v[3 * l + 2];
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i)
            d[3 * k + i] = 1.5 * v[3 * k + i] -
                           0.5 * (gram[k][0] * v[i] + gram[k][1] * v[3 + i] + gram[k][2] * v[6 + i]);
}

/* Three directors; each sees two thirds of the rotation: sum_k d_k x (theta x d_k) = 2 theta. */
static void turn_triple(double *d, const double *change)
{
    double r[3] = {0.0, 0.0, 0.0}, once[3], twice[3], v[9], square = 0.0;
    for (int k = 0; k < 3; ++k) {
        cross(d + 3 * k, change + 3 * k, once);
        for (int i = 0; i < 3; ++i)
            r[i] += once[i] / 4;
    }
    for (int i = 0; i < 3; ++i)
        square += r[i] * r[i];
    for (int k = 0; k < 3; ++k) {
        cross(r, d + 3 * k, once);
        cross(r, once, twice);
        for (int i = 0; i < 3; ++i)
            v[3 * k + i] = d[3 * k + i] + 2 / (1 + square) * (once[i] + twice[i]);
    }
    /* round-off must not add up */
    nearer_triple(v, d);
}

/* Directors `d` of a node, one or three, after a finite rotation that agrees with `change` to first
 * order; a node whose change is larger than `most` takes it as it is. Returns whether it is. */
static int turn(int directors, double *d, const double *change, double most)
{
    double square = 0.0;
    for (int i = 0; i < 3 * directors; ++i)
        square += change[i] * change[i];
    int far = square > most * most;
    for (int i = 0; far && i < 3 * directors; ++i)
        d[i] += change[i];
    if (!far)
        (directors == 1 ? turn_vector : turn_triple)(d, change);
    return far;
}

/* Rates of orthonormal directors without what changes lengths and angles, in place. */
static void keep_constraints(int directors, const double *d, double *v)
{
    double part[9];
    for (int k = 0; k < directors; ++k)
        for (int l = 0; l < directors; ++l) {
            double sum = 0.0, size = 0.0;
            for (int i = 0; i < 3; ++i) {
                sum += d[3 * l + i] * v[3 * k + i] + d[3 * k + i] * v[3 * l + i];
                size += d[3 * l + i] * d[3 * l + i];
            }
            part[3 * k + l] = sum / 2 / size;
        }
    for (int k = 0; k < directors; ++k)
        for (int l = 0; l < directors; ++l)
            for (int i = 0; i < 3; ++i)
                v[3 * k + i] -= part[3 * k + l] * d[3 * l + i];
}

/* The same of nodes in vectors of unknowns, whose rates, if they are among them, keep the constraints
 * of the directors that are turned. What is to be subtracted from `x`, `dx`, becomes one that turns them. */
int turn_nodes(const Turning *t, const double *x, double *dx, double most)
{
    int far = 0, n = 3 * t->directors;
    double d[9], change[9];
    for (int k = 0; k < t->nodes * n; k += n) {
        const int64_t *rows = t->rows + k, *rates = t->rates + k;
        const double *reference = t->reference + k;
        for (int i = 0; i < n; ++i) {
            d[i] = reference[i] + x[rows[i]];
            change[i] = -dx[rows[i]];
        }
        far += turn(t->directors, d, change, most);
        for (int i = 0; i < n; ++i)
            dx[rows[i]] = x[rows[i]] - (d[i] - reference[i]);
        for (int i = 0; t->rates && i < n; ++i) {
            d[i] = reference[i] + x[rows[i]] - dx[rows[i]];
            change[i] = x[rates[i]] - dx[rates[i]];
        }
        if (t->rates)
            keep_constraints(t->directors, d, change);
        for (int i = 0; t->rates && i < n; ++i)
            dx[rates[i]] = x[rates[i]] - change[i];
    }
    return far;
}

/* Directors of a node, one or three, that are nearly orthonormal, made so in place. */
static void normalise(int directors, double *d)
{
    if (directors == 1) {
        double size = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        for (int i = 0; i < 3; ++i)
            d[i] /= size;
        return;
    }
    for (int step = 0; step < 4; ++step) {
        double v[9];
        memcpy(v, d, sizeof(v));
        nearer_triple(v, d);
    }
}

/* The same in a vector of unknowns, as of turn_nodes. */
void normalise_nodes(const Turning *t, double *x)
{
    int n = 3 * t->directors;
    double d[9], v[9];
    for (int k = 0; k < t->nodes * n; k += n) {
        const int64_t *rows = t->rows + k, *rates = t->rates + k;
        for (int i = 0; i < n; ++i)
            d[i] = t->reference[k + i] + x[rows[i]];
        normalise(t->directors, d);
        for (int i = 0; i < n; ++i) {
            x[rows[i]] = d[i] - t->reference[k + i];
            d[i] = t->reference[k + i] + x[rows[i]];
        }
        for (int i = 0; t->rates && i < n; ++i)
            v[i] = x[rates[i]];
        if (t->rates)
            keep_constraints(t->directors, d, v);
        for (int i = 0; t->rates && i < n; ++i)
            x[rates[i]] = v[i];
    }
}

/* Largest violation of the constraints of nodes that count, `reference` + value: lengths, halves of
 * squares as their derivatives are, and right angles. What is no number wins. `back` gets the least
 * change that takes nodes beyond `bound` back to them, to first order: `-C^T (C C^T)^-1 g`. */
double violation(int nodes, int directors, const int64_t *dofs, const double *reference,
                 const double *values, const unsigned char *counts, double bound, double *back)
{
    double most = 0.0, d[MOST_SIZE], g[MOST_ROWS], C[MOST_ROWS * MOST_SIZE], P[MOST_ROWS * MOST_SIZE];
    int n = 3 * directors, c = directors == 1 ? 1 : MOST_ROWS;
    for (int node = 0; node < nodes; ++node, dofs += n, reference += n, back += n) {
        double own = 0.0;
        for (int i = 0; i < n; ++i)
            d[i] = reference[i] + values[dofs[i]];
        for (int row = 0; counts[node] && row < c; ++row) {
            const double *a = d + 3 * PAIRS[row][0], *b = d + 3 * PAIRS[row][1];
            g[row] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            g[row] = a == b ? (g[row] - 1) / 2 : g[row];
            own = !(fabs(g[row]) <= own) && own == own ? fabs(g[row]) : own;
        }
        most = !(own <= most) && most == most ? own : most;
        memset(back, 0, sizeof(double) * n);
        if (!(own > bound))
            continue;
        constraint_rows(directors, d, C);
        small_inverse(c, n, C, P);
        small_product(n, c, 1, -1.0, P, g, back);
    }
    return most;
}
