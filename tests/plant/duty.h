/* Hours of ordinary duty for the watch: random moves, dwells, hovering and jogs, with the usual
 * errors of torque, temperature and encoders. */
#ifndef LOSTMOTION_TESTS_PLANT_DUTY_H
#define LOSTMOTION_TESTS_PLANT_DUTY_H

#include "lostmotion/runtime.h"

/* Errors beyond the usual ones: the stated torque is this factor times the true one (1: no error;
 * -1: wrong sign; 2.5: another drive), or the drive compensates itself, so that no lost motion is
 * measured. */
typedef struct misuse {
  double torque_factor;
  int compensated;
} misuse;

/* Runs for hours of duty, or until the first fade where `until_caught`. Returns the number of times
 * that the correction began to fade; *first_s: seconds to the first, -1 for none, of duty or, where
 * `until_caught`, since the drive's lost motion first was twice misfit_rad: at rest before that the
 * correction causes no error, and there is nothing to find. */
long run_duty(const lm_parameters *parameters, double hours, misuse wrong, int until_caught,
              unsigned seed, double *first_s);

#endif
