"""Parameters of a controller, from the drive file to the struct of the library.

A `Controller` has the parameters of the run-time code as Python objects. The C library builds its
struct from them in the controller's precision and checks it; header and blob are written from that
struct, so that the controller accepts them as well.
"""
