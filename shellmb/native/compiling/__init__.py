"""From forms to machine code: FFCx, kernels of several cells at once, the C compiler."""
