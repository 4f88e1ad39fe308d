/* Load capacity of a drive: formulas of the sources by hand, and the balance of the forces. */
#include "lostmotion/load_capacity.h"

#include "reference_drives.h"
#include "test.h"

static lm_design_workspace workspace;
static lm_contributions at[1];
static lm_fault fault;

static lm_drive size20(void) {
  lm_drive drive = reference_a();
  TEST_ASSERT_EQUAL_MESSAGE(LM_OK, lm_complete_drive(&drive, &fault), fault.input);
  return drive;
}

/* NASA SP-8007: 0.747 * 0.67 E (t/r)^1.25 (r/l)^0.5, torque 2 pi r^2 t tau. */
TEST(the_wall_buckles_as_a_thin_cylinder) {
  lm_drive drive = size20();
  double slender;
  double tau;
  drive.flexspline.wall_thickness_mm = LM_REAL(0.35);
  drive.flexspline.length_mm = LM_REAL(22);
  slender = 0.35 / 25;
  tau = 0.747 * 0.67 * 2.1e5 * pow(slender, 1.25) * sqrt(25.0 / 17);
  ASSERT_NEAR(0.05, 2 * 3.14159265358979 * 625 * 0.35 * tau / 1000,
              lm_cup_buckling_torque(&drive, LM_REAL(25)));
}

/* The strip is clamped at the hub; its other end turns by w / L and shifts by r w / (4 L). The
 * bending is inversely proportional to the length of the cup. */
TEST(coning_falls_with_the_length_of_the_cup) {
  lm_drive drive = size20();
  lm_real shorter;
  drive.flexspline.wall_thickness_mm = LM_REAL(0.35);
  drive.flexspline.length_mm = LM_REAL(22);
  shorter = lm_coning_stress(&drive, LM_REAL(25));
  /* hub: 6 / t^2 * 1.75 E t^3 / (12 (1 - nu^2)) / l * slope, l = 10, t = 0.525 */
  ASSERT_NEAR(0.1, 1.75 * 2.1e5 / 0.91 * 0.525 / (2 * 10) * 0.2375 / 22, shorter);
  drive.flexspline.length_mm = LM_REAL(44);
  ASSERT_NEAR(0.01, (double)shorter / 2, lm_coning_stress(&drive, LM_REAL(25)));
}

/* ISO 281 with b_m = 1.3 and f_c = 54; a third of the load is 27 times the life. */
TEST(life_falls_with_the_cube_of_the_load) {
  const lm_drive drive = size20();
  lm_load load;
  double force;
  double life;
  memset(&load, 0, sizeof load);
  load.torque_Nm = LM_REAL(40);
  load.wedge = LM_REAL(0.45);
  ASSERT_NEAR(0.5, 1.3 * 54 * pow(23, 2.0 / 3) * pow(4, 1.8), lm_ball_bearing_rating(23, 4));
  force = 0.65 * 1.3 * 40e3 * 0.45 / 25;
  life = pow((double)drive.support.bearing_rating_N / force, 3) * 1e6 / (60 * 2000);
  ASSERT_NEAR(1e-4 * life, life, lm_bearing_life(&drive, &load, 2000));
  load.torque_Nm = LM_REAL(40.0 / 3);
  ASSERT_NEAR(27e-4 * life, 27 * life, lm_bearing_life(&drive, &load, 2000));
}

/* Share times normal forces; the deflection of the ratcheting torque is the depth. */
TEST(the_loads_are_those_of_the_torque) {
  lm_drive drive = size20();
  const lm_real torque[1] = {40};
  lm_load load;
  lm_load worst;
  int sections;
  for (sections = 1; sections <= 3; sections += 2) {
    drive.axial_sections = sections;
    drive.teeth.rigid_shift = LM_REAL(3.2); /* clear at both edges */
    TEST_ASSERT_EQUAL(LM_OK, lm_prepare_meshes(&drive, LM_NEUTRAL_LINE_NODES, &workspace, &fault));
    TEST_ASSERT_EQUAL(LM_OK,
                      lm_evaluate_torsion_curve(&drive, 0, torque, 1, at, 0, &workspace, &fault));
    TEST_ASSERT_EQUAL(LM_OK, lm_measure_load(&drive, 40, &workspace, &load, &fault));
    /* 800 N on each lobe at r = 25; pairs touch a little further out */
    ASSERT_NEAR(40, 40e3 / 2 / 25.8, load.radial_force_N / load.wedge);
    TEST_ASSERT_TRUE(load.largest_share > LM_REAL(0.03) && load.largest_share < LM_REAL(0.5));
    ASSERT_NEAR(1e-3 * (double)load.ratcheting_torque_Nm,
                40 * (double)load.depth_mm / (double)load.deflection_mm, load.ratcheting_torque_Nm);
    /* not deeper than on the axis at the open edge, 1.2 modules and the share of the cone */
    TEST_ASSERT_TRUE(load.depth_mm > 0 && load.depth_mm < LM_REAL(0.36));
    TEST_ASSERT_EQUAL(LM_OK, lm_find_rated_load(&drive, 4, &workspace, &worst, &fault));
    TEST_ASSERT_TRUE(worst.largest_force_N >= load.largest_force_N);
    TEST_ASSERT_TRUE(worst.ratcheting_torque_Nm <= load.ratcheting_torque_Nm);
  }
}

/* The pairs at the edges of the face take part, unless the middle alone is requested. */
TEST(the_rated_load_is_that_of_the_face) {
  lm_drive drive = size20();
  lm_load load[4];
  int sections;
  drive.teeth.rigid_shift = LM_REAL(3.2);
  for (sections = 1; sections <= 3; sections++) {
    drive.axial_sections = sections;
    TEST_ASSERT_EQUAL(LM_OK, lm_find_rated_load(&drive, 2, &workspace, &load[sections], &fault));
    TEST_ASSERT_EQUAL(sections, drive.axial_sections);
  }
  TEST_ASSERT_TRUE(load[1].ratcheting_torque_Nm == load[3].ratcheting_torque_Nm);
  TEST_ASSERT_TRUE(load[2].ratcheting_torque_Nm == load[3].ratcheting_torque_Nm);
  TEST_ASSERT_TRUE(load[1].largest_force_N == load[3].largest_force_N);
  drive.axial_sections = 1;
  drive.planar_only = 1;
  TEST_ASSERT_EQUAL(LM_OK, lm_find_rated_load(&drive, 2, &workspace, &load[0], &fault));
  TEST_ASSERT_TRUE(load[0].ratcheting_torque_Nm != load[3].ratcheting_torque_Nm);
}

/* Usual: a cone, and the torque passes from the inner edge through the rim. Even: a very long cup,
 * whose rim does not twist. */
TEST(the_edge_of_a_cone_carries_more_of_the_load) {
  lm_drive drive = size20();
  lm_load load;
  drive.teeth.rigid_shift = LM_REAL(3.2);
  TEST_ASSERT_EQUAL(LM_OK, lm_find_rated_load(&drive, 2, &workspace, &load, &fault));
  TEST_ASSERT_TRUE(load.section_share > LM_REAL(0.5));
  drive.flexspline.length_mm = LM_REAL(1e5);
  drive.material.shear_modulus_MPa *= LM_REAL(100);
  TEST_ASSERT_EQUAL(LM_OK, lm_find_rated_load(&drive, 2, &workspace, &load, &fault));
  ASSERT_NEAR(0.01, 1.0 / LM_FACE_SECTIONS, load.section_share);
  drive.planar_only = 1;
  TEST_ASSERT_EQUAL(LM_OK, lm_find_rated_load(&drive, 2, &workspace, &load, &fault));
  TEST_ASSERT_TRUE(load.section_share == LM_REAL(1));
}

TEST(a_higher_load_is_a_higher_stress) {
  lm_drive drive = size20();
  lm_load low;
  lm_load high;
  TEST_ASSERT_EQUAL(LM_OK, lm_find_rated_load(&drive, 2, &workspace, &low, &fault));
  drive.rated_torque_Nm = 120;
  TEST_ASSERT_EQUAL(LM_OK, lm_find_rated_load(&drive, 2, &workspace, &high, &fault));
  TEST_ASSERT_TRUE(high.flank_pressure_MPa > low.flank_pressure_MPa);
  TEST_ASSERT_TRUE(high.flexspline_root_MPa > low.flexspline_root_MPa);
  TEST_ASSERT_TRUE(high.rigid_root_MPa > low.rigid_root_MPa);
  TEST_ASSERT_TRUE(high.deflection_mm > low.deflection_mm);
}

TEST(nonsense_is_refused) {
  const lm_drive drive = size20();
  lm_load load;
  TEST_ASSERT_EQUAL(LM_NULL, lm_measure_load(0, 40, &workspace, &load, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_measure_load(&drive, 0, &workspace, &load, &fault));
  workspace.take_up.active_count = 0;
  TEST_ASSERT_EQUAL(LM_NO_CONTACT, lm_measure_load(&drive, 40, &workspace, &load, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_find_rated_load(&drive, 1, 0, &load, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_find_rated_load(&drive, 0, &workspace, &load, &fault));
}
