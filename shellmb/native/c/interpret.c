/* Programs as FFCx's kernels are called: they stand in the bits of the first constants, one of each integral.
 * Our loops tell by the last argument where a cell's values are kept, if they are; then coefficients are those
 * that the program reads, and not all. */
#define INTERPRET(k)                                                                               \
    void interpret_one_##k(double *A, const double *w, const double *c, const double *x,           \
                           const int *entity, const uint8_t *permutation, void *custom)            \
    {                                                                                              \
        (void)permutation;                                                                         \
        interpret_of_one(A, w, c, k, x, entity, (double **)custom);                                                   \
    }                                                                                              \
    void interpret_lanes_##k(double *A, const double *w, const double *c, const double *x,         \
                             const int *entity, const uint8_t *permutation, void *custom)          \
    {                                                                                              \
        (void)permutation;                                                                         \
        interpret_of_lanes((lanes *)A, (const lanes *)w, c, k, (const lanes *)x, entity, (lanes **)custom);          \
    }
