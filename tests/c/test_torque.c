#include "lostmotion/torque.h"

#include "test.h"

static lm_motor motor;
static lm_load_guess guess;

void setUp(void) {
  motor.torque_constant_Nm_per_A = LM_REAL(0.1);
  motor.ratio = 100;
  motor.efficiency = LM_REAL(0.8);
  motor.rotor_inertia_kg_m2 = LM_REAL(1e-4);
  motor.coulomb_Nm = LM_REAL(0.05);
  motor.viscous_Nm_s = LM_REAL(1e-3);
  motor.standstill_rad_s = LM_REAL(0.1);
  guess.friction_Nm = 5;
  guess.stiffness_Nm_per_rad = LM_REAL(1e4);
}

static void assert_near(double expected, lm_real found) {
  double difference = (double)found - expected;
  TEST_ASSERT_TRUE(difference < 1e-4 && difference > -1e-4);
}

/* 4 A are 0.4 N*m; at 10 rad/s friction reduces the torque by 0.05 + 0.01, at 100 rad/s^2 the rotor
 * by 0.01. */
TEST(a_motor_that_drives_loses_by_efficiency) {
  assert_near(-(0.4 - 0.06 - 0.01) * 100 * 0.8, lm_estimate_torque(&motor, 4, 10, 100));
  assert_near((0.4 - 0.06) * 100 * 0.8, lm_estimate_torque(&motor, -4, -10, 0));
}

TEST(a_motor_that_is_driven_holds_less_than_the_load) {
  assert_near(-(0.4 + 0.06) * 100 / 0.8, lm_estimate_torque(&motor, 4, -10, 0));
}

TEST(at_standstill_neither_friction_nor_efficiency_count) {
  assert_near(-40, lm_estimate_torque(&motor, 4, 0, 0));
  assert_near(-(0.4 - 0.025 - 5e-5) * 100 * 0.9, lm_estimate_torque(&motor, 4, LM_REAL(0.05), 0));
}

TEST(the_sign_of_the_ratio_counts) {
  motor.ratio = -100;
  assert_near(40, lm_estimate_torque(&motor, 4, 0, 0));
}

TEST(the_guess_resists_motion_and_has_a_dead_band) {
  lm_real resisting_Nm = 0;
  int i;
  assert_near(-5, lm_guess_torque(&guess, &resisting_Nm, LM_REAL(0.01), 0));
  assert_near(5, lm_guess_torque(&guess, &resisting_Nm, LM_REAL(-0.01), 0));
  /* Hovering by less than friction / stiffness = 0.5 mrad does not flip it. */
  for (i = 0; i < 100; ++i) {
    lm_real small_rad = (i % 2) ? LM_REAL(-3e-4) : LM_REAL(3e-4);
    TEST_ASSERT_TRUE(lm_guess_torque(&guess, &resisting_Nm, small_rad, 0) > 0);
  }
  assert_near(7, lm_guess_torque(&guess, &resisting_Nm, -1, 2));
}

TEST(a_motion_that_is_not_finite_is_not_made) {
  lm_real zero = 0;
  lm_real resisting_Nm = 3;
  assert_near(3, lm_guess_torque(&guess, &resisting_Nm, zero / zero, 0));
  assert_near(3, resisting_Nm);
}

/* What the motor holds may be friction, or what the gear loses. */
TEST(at_standstill_the_friction_may_point_either_way) {
  lm_real zero = 0;
  assert_near(0.05 * 100 / 0.8, lm_bound_torque(&motor, 0, 0));
  assert_near((0.05 * 100 + 20 * 0.2) / 0.8, lm_bound_torque(&motor, -20, 0));
  assert_near(0.025 * 100 / 0.8, lm_bound_torque(&motor, 0, LM_REAL(-0.05)));
  TEST_ASSERT_TRUE(lm_bound_torque(&motor, 20, 3) == 0);
  assert_near(0.05 * 100 / 0.8, lm_bound_torque(&motor, 0, zero / zero));
  motor.ratio = -100;
  assert_near(0.05 * 100 / 0.8, lm_bound_torque(&motor, 0, 0));
}

/* Whatever the direction of friction and of the power, the torque is within the bound. */
TEST(at_standstill_the_torque_is_within_the_bound) {
  int k;
  for (k = 0; k < 4; ++k) {
    lm_real friction_Nm = k % 2 ? motor.coulomb_Nm : -motor.coulomb_Nm;
    lm_real factor = k < 2 ? motor.efficiency : 1 / motor.efficiency;
    lm_real current_A = LM_REAL(2.5);
    lm_real torque_Nm = -(motor.torque_constant_Nm_per_A * current_A - friction_Nm) * motor.ratio;
    lm_real found_Nm = lm_estimate_torque(&motor, current_A, 0, 0);
    lm_real off_Nm = torque_Nm * factor - found_Nm;
    lm_real bound_Nm = lm_bound_torque(&motor, found_Nm, 0);
    TEST_ASSERT_TRUE((off_Nm < 0 ? -off_Nm : off_Nm) <= bound_Nm * LM_REAL(1.0001));
  }
}

/* The truth is always possible, so the error of the estimate is never more than twice the
 * uncertainty.
 */
TEST(a_held_torque_moves_no_further_than_it_must) {
  lm_real believed = 0;
  assert_near(7, lm_hold_torque(&believed, 10, 3));
  assert_near(7, lm_hold_torque(&believed, 5, 3));
  assert_near(7, lm_hold_torque(&believed, 8, 3));
  assert_near(5, lm_hold_torque(&believed, 2, 3));
  assert_near(-4, lm_hold_torque(&believed, -4, 0));
}

TEST(a_held_torque_survives_any_input) {
  lm_real zero = 0;
  lm_real believed = 2;
  TEST_ASSERT_TRUE(lm_hold_torque(&believed, zero / zero, 1) == 2);
  TEST_ASSERT_TRUE(lm_hold_torque(&believed, 1 / zero, 1) == 2);
  TEST_ASSERT_TRUE(lm_hold_torque(&believed, 3, zero / zero) == 3);
  TEST_ASSERT_TRUE(lm_hold_torque(&believed, 4, -1) == 4);
  TEST_ASSERT_TRUE(lm_hold_torque(&believed, 5, 1 / zero) == 5);
}

static void refused(lm_status expected, const char *name) {
  lm_fault fault;
  TEST_ASSERT_EQUAL(expected, lm_check_motor(&motor, &fault));
  TEST_ASSERT_EQUAL_STRING(name, fault.input);
  TEST_ASSERT_EQUAL(expected, lm_check_motor(&motor, NULL));
  setUp();
}

TEST(a_motor_without_meaning_is_refused_by_name) {
  lm_real zero = 0;
  lm_fault fault;
  TEST_ASSERT_EQUAL(LM_NULL, lm_check_motor(NULL, &fault));
  TEST_ASSERT_EQUAL_STRING("motor", fault.input);
  TEST_ASSERT_EQUAL(LM_OK, lm_check_motor(&motor, &fault));
  motor.torque_constant_Nm_per_A = LM_REAL(-0.1);
  motor.ratio = -100;
  motor.efficiency = 1;
  motor.rotor_inertia_kg_m2 = 0;
  motor.coulomb_Nm = 0;
  motor.viscous_Nm_s = 0;
  TEST_ASSERT_EQUAL(LM_OK, lm_check_motor(&motor, &fault));
  motor.efficiency = 0;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_check_motor(&motor, &fault));
  TEST_ASSERT_TRUE(fault.found == 0 && fault.low > 0 && fault.high == 1);
  refused(LM_OUT_OF_RANGE, "efficiency");
  motor.efficiency = LM_REAL(1.01);
  refused(LM_OUT_OF_RANGE, "efficiency");
  motor.torque_constant_Nm_per_A = 0;
  refused(LM_OUT_OF_RANGE, "torque_constant_Nm_per_A");
  motor.ratio = 0;
  refused(LM_OUT_OF_RANGE, "ratio");
  motor.ratio = zero / zero;
  refused(LM_NOT_FINITE, "ratio");
  motor.rotor_inertia_kg_m2 = -1;
  refused(LM_OUT_OF_RANGE, "rotor_inertia_kg_m2");
  motor.coulomb_Nm = LM_REAL(-0.05);
  refused(LM_OUT_OF_RANGE, "coulomb_Nm");
  motor.viscous_Nm_s = 1 / zero;
  refused(LM_NOT_FINITE, "viscous_Nm_s");
  motor.standstill_rad_s = 0;
  refused(LM_OUT_OF_RANGE, "standstill_rad_s");
}
