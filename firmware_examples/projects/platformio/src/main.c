#include "../../main.c" /* the same program as with CMake and make */
