/* The two drives of bindings/python/docs/theory/check_values.md, and helpers of the design
 * tests. */
#ifndef LOSTMOTION_TESTS_REFERENCE_DRIVES_H
#define LOSTMOTION_TESTS_REFERENCE_DRIVES_H

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "lostmotion/drive.h"
#include "test.h"

#define DEGREE (LM_PI / LM_REAL(180))
#define ARCMIN (LM_PI / LM_REAL(10800))
#define HALF_PI (LM_PI / LM_REAL(2))

/* A bound for each precision. */
#define BOUND(float64, float32) (LM_REAL_BITS == 64 ? (float64) : (float32))

/* Unity compares doubles. */
#define ASSERT_NEAR(bound, expected, found) \
  TEST_ASSERT_DOUBLE_WITHIN((double)(bound), (double)(expected), (double)(found))
#define ASSERT_NEAR_AT(bound, expected, found, text) \
  TEST_ASSERT_DOUBLE_WITHIN_MESSAGE((double)(bound), (double)(expected), (double)(found), text)

static inline double in_arcmin(lm_real angle_rad) {
  return (double)angle_rad * 10800.0 / 3.14159265358979323846;
}

/* Numerical Recipes' generator. */
static inline double draw(uint32_t *seed, double low, double high) {
  *seed = *seed * 1664525u + 1013904223u;
  return low + (high - low) * (double)(*seed >> 8) / 16777216.0;
}

/* check_values.md, reference drive A: size 20, ratio 100, two discs at 30 deg. Only the values
 * given there are set.
 */
static inline lm_drive reference_a(void) {
  lm_drive drive;
  memset(&drive, 0, sizeof drive);
  drive.ratio = LM_REAL(100);
  drive.rated_torque_Nm = LM_REAL(40);
  drive.teeth.deformation = LM_INTERNAL;
  drive.teeth.module_mm = LM_REAL(0.25);
  drive.teeth.flexspline_teeth = 200;
  drive.teeth.rigid_teeth = 202;
  drive.teeth.pressure_angle_rad = LM_REAL(20) * DEGREE;
  drive.teeth.flexspline_shift = LM_REAL(3.0);
  drive.teeth.rigid_shift = LM_REAL(2.957);
  drive.teeth.rack_addendum = LM_REAL(1);
  drive.teeth.root_clearance = LM_REAL(0.35);
  drive.teeth.tooth_height = LM_REAL(1.75);
  drive.teeth.engagement_depth = LM_REAL(1.2);
  drive.teeth.face_width_mm = LM_REAL(10);
  drive.generator.type = LM_DISCS;
  drive.generator.deflection_mm = LM_REAL(0.2375);
  drive.generator.contact_half_angle_rad = LM_REAL(30) * DEGREE;
  drive.support.foundation_N_per_mm2 = LM_REAL(2600); /* check_values.md, coupled teeth */
  drive.support.ring_stiffness_N_mm2 = LM_REAL(3.5e5);
  drive.generator.floating = 1;
  drive.flexspline.rim_thickness_mm = LM_REAL(0.6);
  return drive;
}

/* check_values.md, reference drive E: external deformation, ring wave generator at 30 deg. */
static inline lm_drive reference_e(void) {
  lm_drive drive = reference_a();
  drive.teeth.deformation = LM_EXTERNAL;
  drive.teeth.flexspline_teeth = 202;
  drive.teeth.rigid_teeth = 200;
  drive.teeth.rigid_shift = LM_REAL(3.05);
  drive.generator.type = LM_RING;
  return drive;
}

/* A drive with all values that follow from the stated ones. */
static inline lm_drive completed(lm_drive drive) {
  lm_fault unfit;
  TEST_ASSERT_EQUAL(LM_OK, lm_complete_drive(&drive, &unfit));
  TEST_ASSERT_EQUAL(LM_OK, lm_check_drive(&drive, &unfit));
  return drive;
}

#endif
