/* Loops over unknowns: between them and the fields, matrices with few entries in a row, the two
 * passes of a solution, sizes of updates. */
#include <time.h>

/* Pieces of so many numbers each from one place to another. */
void copy_pieces(int count, double **from, const int *sizes, double **to)
{
    for (int k = 0; k < count; ++k)
        memcpy(to[k], from[k], sizeof(double) * sizes[k]);
}

/* Jacobians over all meshes, as of `jacobian`. */
int jacobians(int meshes, const Jacobian *of, const double *shift, double *load)
{
    for (const Jacobian *j = of; j < of + meshes; ++j) {
        copy_pieces(j->pieces, j->from, j->sizes, j->to);
        int bad = jacobian(j->cells, j->kernels, j->count, j->projection, 0, j->cells->cells,
                           j->blocks, j->values, shift, load);
        if (bad)
            return bad;
    }
    return 0;
}

/* Weighted sums of arrays: of each the next few sources and weights. */
void follow(int count, const int *sizes, const int *terms, double **from,
             const double *weights, double **to)
{
    for (int k = 0; k < count; ++k) {
        const int n = sizes[k];
        double *sum = to[k];
        for (int i = 0; i < n; ++i)
            sum[i] = weights[0] * from[0][i];
        for (int term = 1; term < terms[k]; ++term)
            for (int i = 0; i < n; ++i)
                sum[i] += weights[term] * from[term][i];
        from += terms[k];
        weights += terms[k];
    }
}

/* Some rows of a table from rows of another one, which may be narrower; `width` is theirs. */
static ALWAYS void put_rows_of(int width, const RowsToPut *p)
{
    for (int i = 0; i < p->count; ++i) {
        const double *restrict from = p->values + p->from[i] * width;
        double *restrict to = p->table + p->to[i] * p->table_width;
        if (p->divisors) {
            /* integers of 64 bits divide slowly */
            const double *by = p->divisors + (int)p->from[i] / p->components * width;
            for (int j = 0; j < width; ++j)
                to[j] = from[j] / by[j];
        } else {
            for (int j = 0; j < width; ++j)
                to[j] = from[j];
        }
    }
}

/* Rows of several tables; of a frame they have three and six columns. */
void put_rows(int tables, const RowsToPut *put)
{
    for (const RowsToPut *p = put; p < put + tables; ++p)
        if (p->width == 3)
            put_rows_of(3, p);
        else if (p->width == 6)
            put_rows_of(6, p);
        else
            put_rows_of(p->width, p);
}

/* Values of unknowns to the arrays of fields; `ends` of each in what they are all together. */
static void spread(int fields, const int64_t *ends, double **arrays, const int64_t *wanted,
                   const double *x)
{
    int64_t i = 0;
    for (int field = 0; field < fields; ++field)
        for (double *to = arrays[field]; i < ends[field]; ++i)
            *to++ = x[wanted[i]];
}

/* Sums of what local dofs add to their unknowns. */
static void collect(int count, const int64_t *wanted, const double *local, int owned, double *b)
{
    memset(b, 0, sizeof(double) * owned);
    for (int i = 0; i < count; ++i)
        b[wanted[i]] += local[i];
}

/* Rows of fixed unknowns: what holds them is kept in `reactions`, `x - values` takes its place. */
static void hold(int count, const int64_t *fixed, const double *x, const double *values, double *b,
          double *reactions)
{
    for (int i = 0; i < count; ++i) {
        reactions[i] = b[fixed[i]];
        b[fixed[i]] = x[fixed[i]] - values[fixed[i]];
    }
}

/* Give the fields the unknowns `x`. */
static void give(const Evaluation *e, const double *x)
{
    spread(e->fields, e->ends, e->arrays, e->wanted, x);
    follow(e->followers, e->sizes, e->terms, e->from, e->weights, e->to);
}

/* Residuals over all meshes, added to `b`. */
void residuals(const Residuals *of, double *b)
{
    for (int k = 0; k < of->meshes; ++k)
        residual(of->cells[k], of->kernels[k], of->counts[k], b);
}

/* Residual `b` at the unknowns `x`, which the fields take. */
static void evaluate_at(const Evaluation *e, const double *x, double *b)
{
    give(e, x);
    memset(e->sums, 0, sizeof(double) * e->local);
    residuals(e->meshes, e->sums);
    collect(e->local, e->wanted, e->sums, e->owned, b);
    hold(e->held, e->fixed, x, e->values, b, e->reactions);
}

/* That of vectors of PETSc. */
void evaluate(const Evaluation *e, uintptr_t x, uintptr_t b)
{
    evaluate_at(e, entries(x, 0), entries(b, 1));
}

/* Changes of local dofs: those with given values get these, and all others stay. */
void to_values(int local, int count, const int64_t *dofs, const int64_t *unknowns,
               const double *values, const double *x, double *change)
{
    memset(change, 0, sizeof(double) * local);
    for (int i = 0; i < count; ++i)
        change[dofs[i]] = values[unknowns[i]] - x[unknowns[i]];
}

/* Largest absolute values of parts of vectors, (count, size), infinite where one is not a number; for
 * each (parts,). */
void largest(const Parts *p, int count, int64_t size, const double *values, double *out)
{
    for (int k = 0; k < count; ++k, values += size)
        for (int part = 0; part < p->parts; ++part) {
            double most = 0.0;
            for (int64_t i = p->ends[part]; i < p->ends[part + 1]; ++i) {
                double found = fabs(values[p->entries[i]]);
                if (!(found <= most))
                    most = found == found ? found : INFINITY;
            }
            *out++ = most;
        }
}

/* Values of the local dofs from those of the columns. */
void combine(const Rows *rows, const double *x, double *y)
{
    const Entries *e = &rows->local;
    memset(y, 0, sizeof(double) * rows->rows);
    for (int k = 0; k < e->count; ++k)
        y[e->row[k]] += rows->values[e->at[k]] * x[e->column[k]];
}

/* The product of the transposed matrix with values of the owned unknowns. */
void distribute(const Rows *rows, const double *b, double *y)
{
    const Entries *e = &rows->own;
    memset(y, 0, sizeof(double) * rows->columns);
    for (int k = 0; k < e->count; ++k)
        y[e->column[k]] += rows->values[e->at[k]] * b[e->row[k]];
}

/* A change relative to a size or a scale, whichever is larger; infinite where change or size is. */
static double relative_to(double change, double size, double scale)
{
    int finite = change < INFINITY && size < INFINITY;
    return finite ? change / (scale > size ? scale : size) : INFINITY;
}

/* What scales count as, times these: a share of them, or the largest of the sizes by their weights. */
static double unit_of(const Parts *p, const double *sizes)
{
    double unit = p->least;
    for (int part = 0; part < p->parts; ++part)
        unit = fmax(unit, p->moves[part] * sizes[part]);
    return unit;
}

/* Of changes and sizes of parts: changes relative to the larger of sizes and scales, in place of the
 * sizes. `found` gets the largest of them; of what is bounded, the largest change over its scale, and
 * whether a change reaches its bound; and the largest of all by their weights. */
void relate(const Parts *p)
{
    double *relative = p->table + p->parts, *found = p->found, unit = unit_of(p, relative);
    found[0] = found[1] = found[2] = found[3] = 0.0;
    for (int part = 0; part < p->parts; ++part) {
        double change = p->table[part], scale = p->scales[part];
        double share = relative_to(change, relative[part], unit * scale);
        double weighted = share < INFINITY ? p->weights[part] * share : share;
        relative[part] = share;
        found[0] = fmax(found[0], share);
        found[3] = fmax(found[3], weighted);
        if (!(change < p->bounds[part]))
            found[2] = 1.0;
        if (p->bounds[part] < INFINITY && change / scale > found[1])
            found[1] = change / scale;
    }
}

/* Largest relative changes of bounded parts and of others, (count, 2), of several changes, (count,
 * parts); `sizes` (parts,). */
void relate_each(const Parts *p, int count, const double *sizes, const double *changes, double *out)
{
    double unit = unit_of(p, sizes);
    for (int k = 0; k < count; ++k, changes += p->parts, out += 2) {
        out[0] = out[1] = 0.0;
        for (int part = 0; part < p->parts; ++part) {
            double relative = relative_to(changes[part], sizes[part], unit * p->scales[part]);
            double *most = out + !(p->bounds[part] < INFINITY);
            *most = relative > *most ? relative : *most;
        }
    }
}

/* Largest values of parts in changes and in what changes, vectors of PETSc: (2, parts). */
void fill_sizes(const Parts *p, uintptr_t x, uintptr_t dx)
{
    largest(p, 1, 0, entries(dx, 0), p->table);
    largest(p, 1, 0, entries(x, 0), p->table + p->parts);
}

/* From the residual to the right-hand side of the reduced system, in one process. `load`: forces of
 * given changes, or NULL. */
static void before(const Solution *s, const double *b, const double *load, double *rhs)
{
    for (int i = 0; i < s->local; ++i) {
        s->b[i] = b[s->wanted[i]];
        s->change[i] = 0.0;
    }
    for (int k = 0; k < s->parts; ++k)
        reduce(s->part + k, 0, s->b, s->change);
    memcpy(s->reaction, b, sizeof(double) * s->owned);
    for (int i = 0; i < s->local; ++i)
        s->reaction[s->wanted[i]] += s->change[i];
    distribute(&s->force, s->reaction, s->forces);
    for (int i = 0; load && i < s->local; ++i)
        s->reaction[s->wanted[i]] -= load[i];
    distribute(&s->left, s->reaction, s->r);
    size_t size = sizeof(double) * s->reduced;
    memcpy(s->seen, s->r, size);
    memset(s->rest, 0, size);
    for (int k = 0; k < s->parts; ++k)
        if (s->part[k].projection->inner)
            reduce_inner(s->part + k, 0, s->r, s->rest);
    for (int i = 0; i < s->outer; ++i)
        rhs[i] = s->seen[s->outer_numbers[i]] + s->rest[s->outer_numbers[i]];
}

/* From the solution of the reduced system to that of all unknowns; after `before`. `given`: given
 * changes of the local dofs. */
static void after(const Solution *s, const double *solution, const double *given, double *dx)
{
    memset(s->seen, 0, sizeof(double) * s->reduced);
    for (int i = 0; i < s->outer; ++i)
        s->seen[s->outer_numbers[i]] = solution[i];
    for (int k = 0; k < s->parts; ++k)
        if (s->part[k].projection->inner)
            expand_inner(s->part + k, 0, s->r, s->seen);
    double *x = s->b;
    combine(&s->right, s->seen, x);
    for (int i = 0; i < s->local; ++i)
        x[i] -= given[i];
    memset(s->rows, 0, sizeof(double) * s->multipliers);
    for (int k = 0; k < s->parts; ++k)
        expand(s->part + k, 0, x, s->rows);
    for (int i = 0; i < s->multipliers; ++i)
        s->forces[i] -= s->rows[i];
    combine(&s->multiplier, s->forces, s->change);
    for (int i = 0; i < s->owned; ++i)
        dx[i] = x[s->own[i]] + s->change[s->own[i]];
}

/* Numbers of a vector of PETSc, which is told if they are `changed`; NULL if there are none. */
double *entries(uintptr_t vector, int changed)
{
    double *numbers = NULL;
    if (array_of[changed][0]((void *)vector, &numbers))
        return NULL;
    double *lent = numbers;
    array_of[changed][1]((void *)vector, &lent);
    return numbers;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

/* Both passes and the solution between them, with factors of PETSc or (not NULL) in a band; returns
 * PETSc's error. */
static int solve_for(const Solution *s, Reduced *reduced, uintptr_t factors, const Band *band,
                     const double *b, const double *load, const double *given, double *dx)
{
    before(s, b, load, reduced->rhs);
    double begin = now();
    int error = 0;
    if (band)
        band_solve(band, 0, reduced->rhs, reduced->solution);
    else
        error = mat_solve((void *)factors, reduced->right, reduced->unknown);
    reduced->seconds = now() - begin;
    after(s, reduced->solution, given, dx);
    return error;
}

/* That of vectors of PETSc. */
int solve(const Solution *s, Reduced *reduced, uintptr_t factors, const Band *band, uintptr_t b,
          const double *load, const double *given, uintptr_t dx)
{
    return solve_for(s, reduced, factors, band, entries(b, 0), load, given, entries(dx, 1));
}
