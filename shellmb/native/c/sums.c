/* Sums over the nodes of a body: what forces at them are together, and how far it turns. */

/* Where a node is, or by how much it moves (`whole` 0): of positions and of directors. */
static void arm(const double *reference, const int *dofs, const double *q, double whole,
                double *out)
{
    for (int i = 0; i < 3; ++i)
        out[i] = whole * reference[i] + q[dofs[i]];
}

/* Force, moment about the origin, and the sum of the sizes of all forces on positions, added to
 * `sums` (7,). Forces are those at the body's dofs that `counted` marks with one. */
void resultants(const Nodes *n, const double *q, double whole, const double *forces,
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

/* Sums of the middle of a step and of its changes, (43,): the number of
 * positions, their sum, that of their changes, and the sums of x x, x dx, d d, d dd of positions
 * and directors. Returns the largest square of the changes of a node's directors. */
double turning(const Nodes *n, int directors, const double *start, const double *end, double *sums)
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
