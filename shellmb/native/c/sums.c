/* Sums over the nodes of a body: what forces at them are together, and how far it turns. */

/* Where a node is, or by how much it moves (`whole` 0): of positions and of directors. */
static void arm(const double *reference, const int *dofs, const double *q, double whole,
                double *out)
{
    for (int i = 0; i < 3; ++i)
        out[i] = whole * reference[i] + q[dofs[i]];
}

static void resultant(const Nodes *n, const double *q, double whole, const double *forces,
                      const double *counted, double *sums)
{
    double at[3], force[3], moment[3];
    for (int k = 0; k < n->positions + n->arms; ++k) {
        const int position = k < n->positions, *dofs = n->dofs + 3 * k;
        double square = 0.0;
        for (int i = 0; i < 3; ++i) {
            force[i] = counted[dofs[i]] * forces[dofs[i]];
            square += force[i] * force[i];
        }
        arm(n->reference + 3 * k, dofs, q, whole, at);
        cross(at, force, moment);
        for (int i = 0; i < 3; ++i) {
            sums[i] += position ? force[i] : 0.0;
            sums[3 + i] += moment[i];
        }
        sums[6] += position ? sqrt(square) : 0.0;
    }
}

/* Force, moment about the origin, and the sum of the sizes of all forces on positions, added to
 * `sums` (states, 7), of states (states, dofs). Forces are those at the body's dofs that `counted`
 * marks with one. */
void resultants(const Nodes *n, int states, int dofs, const double *q, double whole,
                const double *forces, const double *counted, double *sums)
{
    for (int state = 0; state < states; ++state, q += dofs, forces += dofs, sums += 7)
        resultant(n, q, whole, forces, counted, sums);
}

/* Sums that `turned` takes, of the middle of a step and of its changes, (43,): the number of
 * positions, their sum, that of their changes, and the sums of x x, x dx, d d, d dd of positions
 * and directors. Returns the largest square of the changes of a node's directors. */
double rotation_sums(const Nodes *n, int directors, const double *start, const double *end,
                     double *sums)
{
    double largest = 0.0, square = 0.0;
    memset(sums, 0, sizeof(double) * 43);
    sums[0] = n->positions;
    for (int k = 0; k < n->positions + n->arms; ++k) {
        const int position = k < n->positions, *dofs = n->dofs + 3 * k;
        const double *reference = n->reference + 3 * k;
        double middle[3], change[3], *squares = sums + (position ? 7 : 25);
        for (int i = 0; i < 3; ++i) {
            middle[i] = reference[i] + (start[dofs[i]] + end[dofs[i]]) / 2;
            change[i] = end[dofs[i]] - start[dofs[i]];
            sums[1 + i] += position ? middle[i] : 0.0;
            sums[4 + i] += position ? change[i] : 0.0;
        }
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                squares[3 * i + j] += middle[i] * middle[j];
                squares[9 + 3 * i + j] += middle[i] * change[j];
            }
        if (position)
            continue;
        /* those of a node follow one another */
        if ((k - n->positions) % directors == 0)
            square = 0.0;
        for (int i = 0; i < 3; ++i)
            square += change[i] * change[i];
        /* what is no number stays */
        if (largest == largest && !(square <= largest))
            largest = square;
    }
    return largest;
}

/* `sum (r.r I - r r)` of `sum r r`, times a factor, added to `out`. */
static void add_inertia(const double *squares, double factor, double *out)
{
    const double trace = squares[0] + squares[4] + squares[8];
    for (int i = 0; i < 9; ++i)
        out[i] += factor * ((i % 4 ? 0.0 : trace) - squares[i]);
}

/* `sum a x b` of `sum a b`, times a factor, added to `out`. */
static void add_axial(const double *products, double factor, double *out)
{
    out[0] += factor * (products[5] - products[7]);
    out[1] += factor * (products[6] - products[2]);
    out[2] += factor * (products[1] - products[3]);
}

/* The best fit of `dr = w x r` to these sums: twice the tangent of half the angle, which is the
 * length of `w`, and the radius of gyration of the positions about its axis. Of the diagonal `tiny`
 * is added, so that what does not turn at all has a fit, too. */
void turned(const double *sums, double tiny, double *found)
{
    double about[18], inertia[9] = {0.0}, spin[3] = {0.0}, of_positions[9] = {0.0};
    const double count = sums[0], *x = sums + 1, *dx = sums + 4;
    for (int i = 0; i < 9; ++i) {
        about[i] = sums[7 + i] - x[i / 3] * x[i % 3] / count;
        about[9 + i] = sums[16 + i] - x[i / 3] * dx[i % 3] / count;
    }
    const double size = (about[0] + about[4] + about[8]) / count;
    found[0] = found[1] = 0.0;
    if (!(size > 0))
        return;
    add_inertia(about, 1.0, of_positions);
    add_inertia(about, 1 / size, inertia);
    add_inertia(sums + 25, 1.0, inertia);
    add_axial(about + 9, 1 / size, spin);
    add_axial(sums + 34, 1.0, spin);
    double largest = 0.0;
    for (int i = 0; i < 9; ++i)
        largest = inertia[i] > largest ? inertia[i] : largest;
    for (int i = 0; i < 9; i += 4)
        inertia[i] += tiny * largest;
    int three = 3, one = 1, pivots[3], info;
    gesv(&three, &one, inertia, &three, pivots, spin, &three, &info);
    if (info)
        return;
    for (int i = 0; i < 3; ++i)
        found[0] += spin[i] * spin[i];
    found[0] = sqrt(found[0]);
    if (!(found[0] > 0))
        return;
    for (int i = 0; i < 9; ++i)
        found[1] += spin[i / 3] * of_positions[i] * spin[i % 3];
    /* of nodes on the axis there may be less than nothing, by round-off */
    found[1] = found[1] > 0 ? sqrt(found[1] / count) / found[0] : 0.0;
}
