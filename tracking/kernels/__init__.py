"""The native kernels, the options they run with, and arrays as they take them."""
