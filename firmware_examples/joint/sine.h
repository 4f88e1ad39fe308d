/* Sine without libm, so that the example prints the same digits on every target. */
#ifndef JOINT_SINE_H
#define JOINT_SINE_H

/* Sine of an angle [rad] of at most 1e4 in size; absolute error below 1e-6. */
float sine(float angle_rad);

/* Square root of a number between 1e-24 and 1e24; 0 of one that is not positive. */
float square_root(float value);

#endif
