import os

# one thread per process: the runs share two cores, and timings of figures and programs stay comparable
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
