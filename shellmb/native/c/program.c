/* Integrands as programs (shellmb/native/programs): numbers of type V, of one cell or of LANES side by side.
 *
 * At a few points of a rule at once: values of functions, operations on them, and what these give times values
 * of test and trial functions. This text is there twice, for both types.
 */

#define AT(k) (base[(k) >> 30] + ((k) & (KEPT - 1)))

#define THREE(k) _Pragma("GCC unroll 3") for (int k = 0; k < 3; ++k)

static void NAME(load)(const Rule *r, const Loads *l, int entity, int from, int count, const V *restrict w,
                       V *restrict registers)
{
    const Table *t = r->tables + l->table;
    const int *begin = t->begin + entity * r->points + from;
    int full = begin[count] - begin[0] == count * t->nodes, N = t->nodes, s = l->stride;
    for (int i = 0; i < l->count; i += 3) {
        const V *from_of[3];
        V *to[3];
        int p = 0;
        /* where there are fewer the first one is found again */
        THREE(k) {
            int one = i + k < l->count ? i + k : i;
            from_of[k] = w + l->first[one];
            to[k] = registers + l->to[one];
        }
        for (; full && p + 1 < count; p += 2) {
            const double *v = t->value + begin[p], *q = t->value + begin[p + 1];
            V sum[3] = {0}, next[3] = {0};
            for (int e = 0; e < N; ++e)
                THREE(k) {
                    V value = from_of[k][e * s];
                    sum[k] += v[e] * value;
                    next[k] += q[e] * value;
                }
            THREE(k) to[k][p] = sum[k], to[k][p + 1] = next[k];
        }
        for (; p < count; ++p) {
            V sum[3] = {0};
            for (int e = begin[p]; e < begin[p + 1]; ++e)
                THREE(k) sum[k] += t->value[e] * from_of[k][t->node[e] * s];
            THREE(k) to[k][p] = sum[k];
        }
    }
}

#define FEW(i) _Pragma("GCC unroll 4") for (int i = 0; i < n; ++i)
#define OF_ALL(expression)                                                                         \
    FEW(i) to[i] = expression;                                                                     \
    break
#define ENTRIES(expression)                                                                        \
    for (int i = 0; i < n; ++i)                                                                    \
        o[i] = expression;                                                                         \
    break;

#define ENTRY(code, f) case code: ENTRIES(f(x[i]))
#define PAIR(code, holds) case code: ENTRIES(x[i] holds y[i])

/* Functions, comparisons and choices, number by number. */
static __attribute__((noinline)) void NAME(apply)(const Instruction *k, V *const *base, int n)
{
    double *restrict o = (double *)(base[0] + k->to);
    const double *x = (const double *)AT(k->a), *y = (const double *)AT(k->b), *z = (const double *)AT(k->c);
    n *= sizeof(V) / sizeof(double);
    switch (k->op) {
    case POW: ENTRIES(pow(x[i], y[i]))
    case ATAN2: ENTRIES(atan2(x[i], y[i]))
    case MIN: ENTRIES(y[i] < x[i] ? y[i] : x[i])
    case MAX: ENTRIES(y[i] > x[i] ? y[i] : x[i])
    case SIGN: ENTRIES((x[i] > 0) - (x[i] < 0))
    FUNCTIONS(ENTRY)
    COMPARISONS(PAIR)
    case AND: ENTRIES(x[i] != 0 && y[i] != 0)
    case OR: ENTRIES(x[i] != 0 || y[i] != 0)
    case NOT: ENTRIES(x[i] == 0)
    case CHOOSE: ENTRIES(x[i] != 0 ? y[i] : z[i])
    }
}

#define TERMS(count, adds, factor)                                                                 \
    for (int j = count; j > 0; --j, t += 2) {                                                      \
        const V *y = AT(t[1]);                                                                     \
        FEW(i) sum[i] adds factor * y[i];                                                          \
    }

static INLINED void NAME(operate_on)(int count, const Instruction *code, const int *terms,
                                      V *const *base, const double *u, int n)
{
    static const V zero;
    for (const Instruction *k = code; k < code + count; ++k) {
        V *restrict to = base[0] + k->to;
        const V *a = AT(k->a), *b = AT(k->b);
        switch (k->op) {
        case ADD: OF_ALL(a[i] + b[i]);
        case ADD_U: OF_ALL(a[i] + u[k->b]);
        case SUB: OF_ALL(a[i] - b[i]);
        case SUB_U: OF_ALL(a[i] - u[k->b]);
        case U_SUB: OF_ALL(u[k->a] - b[i]);
        case MUL: OF_ALL(a[i] * b[i]);
        case U_MUL: OF_ALL(u[k->a] * b[i]);
        case DIV: OF_ALL(a[i] / b[i]);
        case U_DIV: OF_ALL(u[k->a] / b[i]);
        case SUM: {
            const int *t = terms + k->a;
            V sum[4];
            FEW(i) sum[i] = zero + u[k->d];
            TERMS(k->b & 0xffff, +=, AT(t[0])[i])
            TERMS(k->b >> 16, -=, AT(t[0])[i])
            TERMS(k->c & 0xffff, +=, u[t[0]])
            TERMS(k->c >> 16, -=, u[t[0]])
            FEW(i) to[i] = sum[i];
            break;
        }
        case FILL: OF_ALL(zero + u[k->a]);
        default: NAME(apply)(k, base, n);
        }
    }
}

static void NAME(operate)(const Stage *s, int from, int to, V *const *base, int n)
{
    const Instruction *code = s->code + from;
    const double *u = s->uniform;
    /* so many at once have code of their own, whose loops are unrolled */
    switch (FIXED ? n : 0) {
    case 1: NAME(operate_on)(to - from, code, s->terms, base, u, 1); break;
    case 2: NAME(operate_on)(to - from, code, s->terms, base, u, 2); break;
    case 3: NAME(operate_on)(to - from, code, s->terms, base, u, 3); break;
    case 4: NAME(operate_on)(to - from, code, s->terms, base, u, 4); break;
    default: NAME(operate_on)(to - from, code, s->terms, base, u, n);
    }
}

/* Products of test and trial functions with few values at a point. */
static void NAME(sparse)(const Rule *r, int entity, int from, int count, V *const *base,
                         int columns, V *A)
{
    for (int o = 0; o < r->pairs; ++o) {
        const Pair *pair = r->pair + o;
        const Row *row = r->row + pair->row, *column = r->column + pair->column;
        const Table *s = r->tables + row->table, *t = r->tables + column->table;
        const int *begin = s->begin + entity * r->points + from, *also = t->begin + entity * r->points + from;
        const V *value = AT(pair->of);
        for (int p = 0; p < count; ++p)
            for (int e = begin[p]; e < begin[p + 1]; ++e) {
                V x = s->value[e] * value[p];
                V *to = A + (size_t)(row->first + s->node[e] * row->stride) * columns + column->first;
                for (int f = also[p]; f < also[p + 1]; ++f)
                    to[t->node[f] * column->stride] += t->value[f] * x;
            }
    }
}

/* A tile of m rows and n columns of a product, added at `to`. */
static INLINED void NAME(tile)(int m, int n, int K, const double *left, int lda,
                                                             const V *right, int ldb, V *const *to,
                                                             const int *place)
{
    V sum[4][4];
    _Pragma("GCC unroll 4") for (int i = 0; i < m; ++i)
        _Pragma("GCC unroll 4") for (int j = 0; j < n; ++j)
            sum[i][j] = to[i][place[j]];
    for (int k = 0; k < K; ++k) {
        V b[4];
        _Pragma("GCC unroll 4") for (int j = 0; j < n; ++j)
            b[j] = right[(size_t)k * ldb + j];
        _Pragma("GCC unroll 4") for (int i = 0; i < m; ++i)
            _Pragma("GCC unroll 4") for (int j = 0; j < n; ++j)
                sum[i][j] += left[k * lda + i] * b[j];
    }
    _Pragma("GCC unroll 4") for (int i = 0; i < m; ++i)
        _Pragma("GCC unroll 4") for (int j = 0; j < n; ++j)
            to[i][place[j]] = sum[i][j];
}

#define TILES(m)                                                                                   \
    for (int j = 0; j < M;) {                                                                      \
        int wide = M - j < 3 ? 1 : M - j == 4 ? 4 : 3;                                             \
        switch (FIXED ? wide : 0) {                                                                \
        case 1: NAME(tile)(m, 1, K, left + i, N, from + j, M, rows, place + j); break;             \
        case 3: NAME(tile)(m, 3, K, left + i, N, from + j, M, rows, place + j); break;             \
        default: NAME(tile)(m, FIXED ? 4 : wide, K, left + i, N, from + j, M, rows, place + j);    \
        }                                                                                          \
        j += wide;                                                                                 \
    }

/* Sums of so few values times those of functions. */
static INLINED void NAME(sum_up)(int some, int functions, const double *const *t, const V *value,
                                 V *restrict to)
{
    for (int m = 0; m < functions; ++m) {
        V sum = {0};
        _Pragma("GCC unroll 3") for (int k = 0; k < some; ++k)
            sum += t[k][m] * value[k];
        to[m] = sum;
    }
}

/* Values of products with trial functions, for each test function's value. */
static void NAME(beside)(const Rule *r, const Dense *g, int entity, int from, int count, V *const *base, V *right)
{
    size_t all = (size_t)r->points * g->rows;
    for (int p = 0; p < count; ++p)
        for (int k = 0; k < g->rows; ++k) {
            int at = entity * r->points + from + p;
            /* columns of one component of all rows stand together */
            size_t row = (size_t)(from + p) * g->rows + k;
            V *block = right;
            const int *of = g->of + k * g->columns;
            for (int c = 0; c < g->columns;) {
                int last = g->last[c], M = r->tables[g->column[c]].nodes, found = 0;
                V value[3], *restrict to = block + row * M;
                const double *t[3];
                for (; c < last && found < 3; ++c)
                    if (of[c] >= 0) {
                        value[found] = AT(of[c])[p];
                        t[found++] = r->tables[g->column[c]].dense + (size_t)at * M;
                    }
                switch (found) {
                case 0: NAME(sum_up)(0, M, t, value, to); break;
                case 1: NAME(sum_up)(1, M, t, value, to); break;
                case 2: NAME(sum_up)(2, M, t, value, to); break;
                default: NAME(sum_up)(3, M, t, value, to);
                }
                /* more derivatives than three of one component */
                for (; c < last; ++c)
                    if (of[c] >= 0)
                        for (int m = 0; m < M; ++m)
                            to[m] += r->tables[g->column[c]].dense[(size_t)at * M + m] *
                                     AT(of[c])[p];
                block += all * M;
            }
        }
}

/* Products of test functions at so many points, from one on, with all that is beside them: those of a matrix,
 * or the values themselves. */
static ALWAYS void NAME(dense)(const Rule *r, const Dense *g, int first, int count, int columns, const V *right,
                        double *left, V *A)
{
    int N = g->nodes, K = count * g->rows;
    for (int p = 0; p < count; ++p)
        for (int k = 0; k < g->rows; ++k)
            memcpy(left + (size_t)(p * g->rows + k) * N,
                   r->tables[g->table[k]].dense + (size_t)(first + p) * N, sizeof(double) * N);
    for (int i = 0; i < N;) {
        V *rows[4];
        int some = N - i < 3 ? 1 : N - i == 4 ? 4 : 3;
        for (int k = 0; k < some; ++k)
            rows[k] = A + (size_t)(g->first + (i + k) * g->stride) * columns;
        const V *from = right;
        const int *place = g->place;
        for (int h = 0; h < (g->blocks ? g->blocks : 1); ++h) {
            int M = g->blocks ? g->block[h] : g->columns;
            switch (FIXED ? some : 0) {
            case 1: TILES(1) break;
            case 3: TILES(3) break;
            default: TILES(FIXED ? 4 : some)
            }
            from += (size_t)K * M;
            place += M;
        }
        i += some;
    }
}

/* A sum over the points of values times those of test functions. */
static void NAME(vector)(const Rule *r, int entity, int from, int count, V *const *base, V *A)
{
    for (int o = 0; o < r->rows; ++o) {
        const Row *row = r->row + o;
        const V *value = AT(row->of);
        if (row->table < 0) {
            for (int p = 0; p < count; ++p)
                A[0] += value[p];
            continue;
        }
        const Table *t = r->tables + row->table;
        const int *begin = t->begin + entity * r->points + from;
        V *to = A + row->first;
        for (int p = 0; p < count; ++p)
            for (int e = begin[p]; e < begin[p + 1]; ++e)
                to[t->node[e] * row->stride] += t->value[e] * value[p];
    }
    for (const Dense *g = r->dense; g < r->dense + r->denses; ++g) {
        V right[count * g->rows * g->columns], *to = right;
        double left[count * g->rows * g->nodes];
        for (int p = 0; p < count; ++p)
            for (int k = 0; k < g->rows * g->columns; ++k)
                *to++ = AT(g->of[k])[p];
        NAME(dense)(r, g, entity * r->points + from, count, 1, right, left, A);
    }
}

/* Values of functions and weights at some points, then numbers that all have. */
static void NAME(prepare)(const Rule *r, const Stage *s, int entity, int from, int count, const V *w,
                          const double *c, const V *x, V *registers)
{
    for (const Loads *l = s->load; l < s->load + s->loads; ++l)
        NAME(load)(r, l, entity, from, count, l->coordinates ? x : w, registers);
    if (s->weight >= 0)
        for (int p = 0; p < count; ++p)
            registers[s->weight + p] = (V){0} + r->weights[from + p];
    if (from)
        return;
    double *u = s->uniform + s->numbers;
    for (int k = 0; k < s->constants; ++k)
        *u++ = c[s->constant[k]];
    if (r->entity_size)
        memcpy(u, r->entity + entity * r->entity_size, sizeof(double) * r->entity_size);
    /* the same operations on numbers that all cells and points have */
    double *const all[2] = {s->uniform, s->uniform};
    operate_on_of_one(s->uniform_ops, s->uniform_code, NULL, all, s->uniform, 1);
}

/* Whether what is kept of a cell follows from other numbers than it did; these are kept then. */
static int NAME(stale)(const Program *p, const V *w, const double *c, const V *x, V *own)
{
    int changed = 0;
    double *stamp = p->seen + p->constants;
    for (int k = 0; k < p->constants; ++k) {
        changed |= p->seen[k] != c[p->constant[k]];
        p->seen[k] = c[p->constant[k]];
    }
    *stamp += changed;
    changed = *(double *)own != *stamp;
    V *to = own + 1;
    for (int k = 0; k <= p->ranges; ++k) {
        const V *from = k < p->ranges ? w + p->range[k].first : x;
        size_t size = sizeof(V) * (k < p->ranges ? p->range[k].count : p->coordinates);
        if (changed || memcmp(to, from, size)) {
            changed = 1;
            memcpy(to, from, size);
        }
        to += size / sizeof(V);
    }
    *(double *)own = *stamp;
    return changed;
}

static void NAME(interpret)(V *restrict A, const V *restrict w, const double *c, int number,
                            const V *restrict x, const int *entity, V **ours)
{
    static _Thread_local V *room;
    static _Thread_local size_t size;
    const Program *program;
    memcpy(&program, c + number, sizeof program);
    size_t all = program->registers + program->products + program->factors + program->kept + program->reads;
    if (all > size) {
        free(room);
        room = aligned_alloc(64, (sizeof(V) * all + 63) / 64 * 64);
        size = all;
    }
    int e = entity ? *entity : 0;
    V *own = ours ? *ours : NULL, *some = room + all - program->reads;
    if (!ours && program->reads) {
        for (int k = 0; k < program->reads; ++k)
            some[k] = w[program->read[k]];
        w = some;
    }
    int anew = program->kept && (!own || NAME(stale)(program, w, c, x, own));
    if (!own)
        own = some - program->kept;
    for (const Rule *r = program->rule; r < program->rule + program->rules; ++r) {
        int most = r->chunk;
        V *right = room + program->registers;
        double *left = (double *)(right + program->products);
        for (int from = 0; from < r->points; from += most) {
            int count = r->points - from < most ? r->points - from : most;
            V *base[2] = {room, own + r->place + from * r->kept};
            if (anew && r->kept) {
                NAME(prepare)(r, &r->steady, e, from, count, w, c, x, room);
                NAME(operate)(&r->steady, 0, r->steady.ops, base, count);
                for (int k = 0; k < r->kept; ++k)
                    for (int p = 0; p < count; ++p)
                        base[1][k * most + p] = room[r->keep[k] + p];
            }
            NAME(prepare)(r, &r->always, e, from, count, w, c, x, room);
            NAME(operate)(&r->always, 0, r->first_ops, base, count);
            if (program->rank < 2)
                NAME(vector)(r, e, from, count, base, A);
            else {
                NAME(sparse)(r, e, from, count, base, program->columns, A);
                int done = r->first_ops;
                for (int g = 0; g < r->denses; ++g) {
                    NAME(operate)(&r->always, done, r->dense[g].end, base, count);
                    done = r->dense[g].end;
                    NAME(beside)(r, r->dense + g, e, from, count, base, right + r->dense[g].right);
                }
            }
        }
        for (int g = 0; program->rank == 2 && g < r->denses; ++g)
            NAME(dense)(r, r->dense + g, e * r->points, r->points, program->columns, right + r->dense[g].right, left, A);
    }
}
#undef AT
#undef OF_ALL
#undef ENTRIES
#undef TILES
#undef FEW
#undef THREE
#undef ENTRY
#undef PAIR
#undef TERMS
