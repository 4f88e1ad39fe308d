#include "lostmotion/torsion_curve.h"

#include <string.h>

#include "reference_drives.h"
#include "test.h"

#define PITCH (LM_REAL(2) * LM_PI / LM_REAL(200))

static lm_design_workspace workspace;
static lm_contributions point[LM_TORQUES_MAX];
static lm_mesh_state state;
static lm_fault fault;

/* check_values.md, coupled teeth: the two constants fitted to the catalogue of size 20, and C_t of
 * the pairs.
 */
static lm_drive calibrated(void) {
  lm_drive drive = reference_a();
  drive.support.ring_factor = LM_REAL(7.88);
  drive.support.tooth_compliance_mm_per_N = LM_REAL(3.5e-6);
  drive.torsion_count = 1;
  drive.torsion[0].stiffness_Nm_per_rad = LM_REAL(4.48e4);
  drive.torsion[0].ratio = LM_REAL(1);
  drive = completed(drive);
  drive.radial_law_count = 0; /* ring and wave generator are in the foundation there */
  return drive;
}

static void evaluate(const lm_drive *drive, lm_real phase, const lm_real torque[], int count) {
  TEST_ASSERT_EQUAL(LM_OK, lm_prepare_meshes(drive, LM_NEUTRAL_LINE_NODES, &workspace, &fault));
  TEST_ASSERT_EQUAL(LM_OK, lm_evaluate_torsion_curve(drive, phase, torque, count, point, &state,
                                                     &workspace, &fault));
}

static void even_torques(lm_real torque[], int count, lm_real limit) {
  int i;
  for (i = 0; i < count; i++) {
    torque[i] = limit * LM_REAL(2 * i - (count - 1)) / LM_REAL(count - 1);
  }
}

static lm_real sum_of_parts(const lm_contributions *c) {
  return c->radial_gap_rad + c->side_clearance_rad + c->radial_compliance_rad + c->torsion_rad +
         c->tooth_bending_rad;
}

/* check_values.md, catalogue: size 20 above ratio 50: 1.504, 3.979, 10.499 arcmin at T1, T2, 2
 * T_N. Bars: a factor of 4 from first principles, 3 % with the two constants. */
TEST(torsion_curve_against_the_catalogue) {
  const lm_real torque[] = {7, 25, 80};
  const double catalogue[] = {1.504, 3.979, 10.499};
  lm_drive drive = calibrated();
  int i;
  evaluate(&drive, 0, torque, 3);
  for (i = 0; i < 3; i++) {
    ASSERT_NEAR(0.03 * catalogue[i], catalogue[i], in_arcmin(point[i].total_rad));
  }
  drive = completed(reference_a());
  evaluate(&drive, 0, torque, 3);
  for (i = 0; i < 3; i++) {
    TEST_ASSERT_TRUE(in_arcmin(point[i].total_rad) > catalogue[i] / 4);
    TEST_ASSERT_TRUE(in_arcmin(point[i].total_rad) < catalogue[i] * 4);
  }
}

/* Same table: of it the mesh (gaps as they are, own flank angles: within 0.01 arcmin of the row
 * with g_min taken off) and teeth of a lobe. Tooth share below 5 % (paper: up to a few percent). */
TEST(mesh_share_and_engaged_teeth_of_the_reference) {
  const lm_real torque[] = {LM_REAL(0.4), LM_REAL(1.6), 4, 7, 10, 16, 25, 40, 60, 80};
  const double mesh[] = {.067, .264, .612, .969, 1.235, 1.569, 2.031, 2.732, 3.597, 4.424};
  const int teeth[] = {2, 2, 4, 6, 8, 10, 13, 17, 22, 24};
  const lm_drive drive = calibrated();
  int i;
  evaluate(&drive, 0, torque, 10);
  for (i = 0; i < 10; i++) {
    const double torsion = (double)torque[i] / 4.48e4;
    ASSERT_NEAR(BOUND(1e-15, 1e-8), torsion, point[i].torsion_rad);
    ASSERT_NEAR(0.01, mesh[i], in_arcmin(point[i].total_rad - point[i].torsion_rad));
    TEST_ASSERT_EQUAL(teeth[i], point[i].forward_teeth);
    TEST_ASSERT_EQUAL(0, point[i].backward_teeth);
    TEST_ASSERT_TRUE(point[i].tooth_bending_rad < LM_REAL(0.05) * point[i].total_rad);
  }
}

/* A drive with all contributions: gap, radial chain, three sections. */
static lm_drive rich(void) {
  lm_drive drive = reference_a();
  drive.gap.generator_mm = LM_REAL(0.004);
  drive.friction_angle_rad = LM_REAL(0.1);
  drive.axial_sections = 3;
  drive.teeth.rigid_shift = LM_REAL(3.06);
  return completed(drive);
}

TEST(parts_add_up_and_the_sum_is_monotone_through_zero) {
  lm_real torque[81];
  lm_drive drives[5];
  int d;
  drives[0] = calibrated();
  drives[1] = rich();
  drives[2] = completed(reference_e());
  drives[3] = completed(reference_a());
  drives[3].generator.type = LM_COSINE;
  drives[4] = calibrated();
  drives[4].teeth.rigid_shift = LM_REAL(2.89); /* preloaded */
  for (d = 0; d < 5; d++) {
    int phase;
    even_torques(torque, 81, 2 * drives[d].rated_torque_Nm);
    for (phase = 0; phase < 4; phase++) {
      int i;
      evaluate(&drives[d], PITCH * LM_REAL(phase) / LM_REAL(4), torque, 81);
      for (i = 0; i < 81; i++) {
        const lm_contributions *c = &point[i];
        const lm_real sign = torque[i] < 0 ? LM_REAL(-1) : LM_REAL(1);
        ASSERT_NEAR(BOUND(1e-17, 2e-9), c->total_rad, sum_of_parts(c));
        TEST_ASSERT_TRUE(i == 0 || c->total_rad > point[i - 1].total_rad);
        TEST_ASSERT_TRUE(c->stiffness_Nm_per_rad >= 0);
        TEST_ASSERT_TRUE(sign * c->side_clearance_rad >= -LM_REAL(BOUND(1e-15, 1e-9)));
        TEST_ASSERT_TRUE(sign * c->radial_compliance_rad >= -LM_REAL(BOUND(1e-15, 1e-8)));
        TEST_ASSERT_TRUE(sign * c->torsion_rad >= 0);
        TEST_ASSERT_TRUE(sign * c->tooth_bending_rad >= 0);
      }
      TEST_ASSERT_TRUE(point[40].total_rad == 0);
    }
  }
}

/* At phase 0 the mesh is symmetric: a reversed torque gives the reversed angle; at other phases the
 * mirrored phase does. */
TEST(exchanging_the_flanks_mirrors_the_torsion_curve) {
  const lm_drive drive = rich();
  lm_contributions first[9];
  lm_real torque[9];
  int i;
  even_torques(torque, 9, 80);
  evaluate(&drive, PITCH * LM_REAL(0.3), torque, 9);
  memcpy(first, point, sizeof first);
  evaluate(&drive, -PITCH * LM_REAL(0.3), torque, 9);
  for (i = 0; i < 9; i++) {
    ASSERT_NEAR(BOUND(1e-12, 2e-7), -first[8 - i].total_rad, point[i].total_rad);
    TEST_ASSERT_EQUAL(first[8 - i].forward_teeth, point[i].backward_teeth);
  }
}

/* The stiffness is the slope of the total. */
TEST(stiffness_is_the_slope) {
  const lm_drive drive = rich();
  const lm_real torque[] = {LM_REAL(0.001), LM_REAL(0.002), 5, LM_REAL(5.01), 30, LM_REAL(30.01)};
  int i;
  evaluate(&drive, 0, torque, 6);
  for (i = 0; i < 6; i += 2) {
    const double slope = ((double)torque[i + 1] - (double)torque[i]) /
                         ((double)point[i + 1].total_rad - (double)point[i].total_rad);
    ASSERT_NEAR(BOUND(2e-3, 0.2) * slope, slope, point[i].stiffness_Nm_per_rad);
  }
}

/* (9), (9a): a gap of 10 um adds its full angle above T0 in each direction, a share of it below. */
TEST(radial_gap_closes_at_its_torque) {
  lm_drive drive = calibrated();
  lm_real torque[] = {-10, -1, LM_REAL(0.01), 1, 10};
  double full;
  drive.gap.generator_mm = LM_REAL(0.006);
  drive.gap.teeth_mm = LM_REAL(0.004);
  evaluate(&drive, 0, torque, 5);
  ASSERT_NEAR(BOUND(1e-16, 1e-9), 0.010, state.gap_mm);
  full = 0.010 * tan((double)state.flank_angle_rad) / (double)state.radius_mm;
  ASSERT_NEAR(1e-9, full, point[4].radial_gap_rad);
  ASSERT_NEAR(1e-9, -full, point[0].radial_gap_rad);
  TEST_ASSERT_TRUE(state.gap_torque_Nm > LM_REAL(0.01) && state.gap_torque_Nm < LM_REAL(0.8));
  ASSERT_NEAR(1e-9, full * 0.01 / (double)state.gap_torque_Nm, point[2].radial_gap_rad);
}

/* The mean of the tolerance chain is part of the gap; each zone is clipped by itself, eq (8). */
TEST(tolerance_chain_shifts_the_gap) {
  lm_drive drive = calibrated();
  drive.tolerance_count = 2;
  memset(drive.tolerances, 0, sizeof drive.tolerances);
  drive.tolerances[0].influence = LM_REAL(0.5);
  drive.tolerances[0].lower_mm = LM_REAL(0.010);
  drive.tolerances[0].upper_mm = LM_REAL(0.020);
  drive.tolerances[0].zone = LM_GENERATOR_GAP;
  drive.tolerances[1].influence = LM_REAL(-1);
  drive.tolerances[1].lower_mm = LM_REAL(0.001);
  drive.tolerances[1].upper_mm = LM_REAL(0.003);
  drive.tolerances[1].zone = LM_TEETH_GAP;
  ASSERT_NEAR(1e-9, 0.0075, lm_mean_radial_gap(&drive));
  drive.gap.teeth_mm = LM_REAL(0.005);
  ASSERT_NEAR(1e-9, 0.0105, lm_mean_radial_gap(&drive));
}

/* Section 4: the chain adds c F tan(alpha) / r with F = T tan(alpha) / (2 r), both signs equal. */
TEST(radial_chain_adds_its_angle) {
  lm_drive drive = calibrated();
  const lm_real torque[] = {-20, 20};
  double without[2];
  double tangent;
  double expected;
  int i;
  evaluate(&drive, 0, torque, 2);
  without[0] = (double)point[0].radial_compliance_rad;
  without[1] = (double)point[1].radial_compliance_rad;
  drive.radial_law_count = 1;
  drive.radial_laws[0].coefficient_mm_per_Nn = LM_REAL(1e-5);
  drive.radial_laws[0].exponent = LM_REAL(1);
  drive.radial_laws[0].share = LM_REAL(1);
  drive.radial_laws[0].preload_N = LM_REAL(10);
  evaluate(&drive, 0, torque, 2);
  tangent = tan((double)state.flank_angle_rad);
  expected =
      1e-5 * 20e3 / (2 * (double)state.radius_mm) * tangent * tangent / (double)state.radius_mm;
  for (i = 0; i < 2; i++) {
    ASSERT_NEAR(BOUND(1e-12, 1e-8), (i == 0 ? -1 : 1) * expected,
                (double)point[i].radial_compliance_rad - without[i]);
  }
}

/* Section 6: half width over centre is [tan(a + rho) - tan(a - rho)] / (2 tan a), 0.27 at mu = 0.10
 * and a = 24 deg. */
TEST(friction_of_the_flanks_widens_the_loop) {
  lm_drive drive = calibrated();
  const lm_real torque[] = {-40, 40};
  drive.friction_angle_rad = LM_REAL(0.0996687); /* atan 0.1 */
  evaluate(&drive, 0, torque, 2);
  ASSERT_NEAR(0.005, 0.27, point[1].friction_half_width_rad / point[1].radial_compliance_rad);
  ASSERT_NEAR(BOUND(1e-15, 1e-9), point[0].friction_half_width_rad,
              point[1].friction_half_width_rad);
}

/* Section 3.4: opposite offsets +-delta of the lobes leave a free play of 2 (g_min - delta), the
 * lobe that touches first carries alone at half the stiffness, and the asymptote is the nominal
 * one; beyond g_min the lobes press against each other. With a floating wave generator none of this
 * occurs. */
TEST(eccentricity_of_a_fixed_generator) {
  lm_drive drive = calibrated();
  const lm_real torque[] = {LM_REAL(0.01), LM_REAL(0.02), 80};
  const double shift = 0.005 / 25.8; /* e / r_k, contact radii 25.79 .. 26.09 mm */
  double play;
  double slope;
  double total;
  drive.teeth.rigid_shift = LM_REAL(3.057); /* 0.1 opens every gap by 1.2 arcmin, section 2.3 */
  drive.generator.eccentricity_mm = LM_REAL(0.005);
  drive.generator.eccentricity_angle_rad = HALF_PI;
  evaluate(&drive, 0, torque, 3);
  play = (double)state.free_play_rad;
  slope = (double)point[1].total_rad - (double)point[0].total_rad - 0.01 / 4.48e4;
  total = (double)point[2].total_rad;
  drive.generator.floating = 0;
  evaluate(&drive, 0, torque, 3);
  /* Teeth beside the axis are also moved along their flanks, by up to 1 / cos(flank angle); the
   * polygons of test_clearances_against_polygons.py have each tooth. */
  ASSERT_NEAR(0.05 * shift, play - shift * (1 + 1 / cos(24.2 / 57.29578)) / 2, state.free_play_rad);
  ASSERT_NEAR(BOUND(1e-2, 0.1) * slope, 2 * slope,
              (double)point[1].total_rad - (double)point[0].total_rad - 0.01 / 4.48e4);
  ASSERT_NEAR(0.02 * total, total, point[2].total_rad);
  TEST_ASSERT_EQUAL(0, state.preloaded_pairs);
  drive.generator.eccentricity_mm = LM_REAL(0.02);
  evaluate(&drive, 0, torque, 3);
  TEST_ASSERT_TRUE(state.preloaded_pairs > 0);
  /* Towards a lobe: both of its flanks come nearer, those 6 deg beside the axis, which touch first,
   * by tan 24.2 cos 6 - sin 6. */
  drive.generator.eccentricity_angle_rad = 0;
  drive.generator.eccentricity_mm = LM_REAL(0.005);
  evaluate(&drive, 0, torque, 3);
  ASSERT_NEAR(0.03 * shift, play - shift * 0.342, state.free_play_rad);
  drive.generator.eccentricity_mm = 0;
  evaluate(&drive, 0, torque, 3);
  ASSERT_NEAR(BOUND(1e-15, 1e-9), total, point[2].total_rad);
}

/* Eq (7): a pair gives delta / cos(alpha) along the tangent under P = F / cos(alpha); each of the
 * sections has its share of the face width. Between sections the rim twists as a thin tube: a
 * section by what passes through the rim from its inner edge, 0.27 arcmin over 10 mm at 40 N m and
 * a radius of 25.6 mm. */
TEST(sections_share_the_face_width_and_twist) {
  const lm_real torque[] = {1};
  lm_drive drive = calibrated();
  int sections;
  for (sections = 1; sections <= 3; sections += 2) {
    int i;
    int j;
    drive.axial_sections = sections;
    evaluate(&drive, 0, torque, 1);
    TEST_ASSERT_TRUE(state.pairs > 0);
    for (i = 0; i < state.pairs; i++) {
      const lm_contact *c = &workspace.contacts[i];
      const double secant2 = 1 + (double)c->wedge * (double)c->wedge;
      ASSERT_NEAR(BOUND(1e-18, 1e-11), 3.5e-6 * secant2 * sections, c->compliance_mm_per_N);
    }
    for (i = 0; i < sections; i++) {
      for (j = 0; j < sections; j++) {
        const double mm = sections == 1 ? 0 : 5.0 * (i < j ? i : j);
        const double turn = 0.27 / 10800 * 3.14159265 * mm / 10 * pow(25.6 / 25.1125, 3);
        ASSERT_NEAR(0.02 * turn + 1e-12, turn,
                    40e3 * (double)workspace.foundation.twist_rad_per_Nmm[i][j]);
      }
    }
  }
}

/* A flexspline that is moved along a flank that carries forward slides on it: this gap stays and
 * that of the tooth's other flank changes. Its teeth narrow outwards inside the rigid gear, inwards
 * around it, and each has its own direction. */
TEST(eccentricity_along_a_flank_leaves_its_gap) {
  const lm_real torque[] = {1};
  int d;
  for (d = 0; d < 2; d++) {
    lm_drive drive = completed(d == 0 ? reference_a() : reference_e());
    const double shift = 0.005 / 25.8;
    int changed = 0; /* other flanks */
    int count;
    int i;
    drive.generator.floating = 0;
    drive.generator.eccentricity_mm = LM_REAL(0.005);
    evaluate(&drive, 0, torque, 1);
    count = state.pairs;
    for (i = 0; i + 1 < count; i += 2) {
      const lm_contact *c = &workspace.contacts[i];
      const lm_real lean = LM_REAL(atan((double)c->wedge));
      int k;
      if (c->side < 0) {
        continue;
      }
      drive.generator.eccentricity_angle_rad =
          workspace.clearances[0][c->tooth].angle_rad + (d == 0 ? -lean : lean);
      evaluate(&drive, 0, torque, 1);
      TEST_ASSERT_EQUAL(0, c[0].lobe);
      TEST_ASSERT_EQUAL(1, c[1].lobe);
      ASSERT_NEAR(BOUND(1e-9, 1e-3) * shift, c[0].gap_rad, c[1].gap_rad);
      for (k = 0; k + 1 < count; k += 2) {
        const lm_contact *other = &workspace.contacts[k];
        if (other->tooth == c->tooth && other->side < 0) {
          TEST_ASSERT_TRUE(fabs((double)other[0].gap_rad - (double)other[1].gap_rad) > 1.2 * shift);
          changed++;
        }
      }
    }
    TEST_ASSERT_TRUE(changed > 0);
  }
}

TEST(reversal_is_the_distance_of_both_branches) {
  const lm_drive drive = calibrated();
  const lm_real torque[] = {LM_REAL(-1.6), LM_REAL(1.6)};
  lm_real lost_motion;
  evaluate(&drive, 0, torque, 2);
  TEST_ASSERT_EQUAL(
      LM_OK, lm_reversal_lost_motion(&drive, 0, LM_REAL(1.6), &lost_motion, &workspace, &fault));
  ASSERT_NEAR(1e-12, point[1].total_rad - point[0].total_rad, lost_motion);
  ASSERT_NEAR(0.05, 0.75, in_arcmin(lost_motion)); /* diagnostic table of section 3.2 at g_min 0 */
}

/* Scale invariance (section 2.4): twice the size, the same gaps; compliances of a similar drive
 * under a torque grown with the volume give the same angles. */
TEST(a_similar_drive_has_the_same_angles) {
  lm_drive small = reference_a();
  lm_drive large = reference_a();
  const lm_real at_small[] = {LM_REAL(1.6), 40};
  const lm_real at_large[] = {LM_REAL(12.8), 320};
  double angle[2];
  int i;
  small = completed(small);
  large.rated_torque_Nm = LM_REAL(320);
  large.teeth.module_mm = LM_REAL(0.5);
  large.teeth.face_width_mm = LM_REAL(20);
  large.generator.deflection_mm = LM_REAL(0.475);
  large.flexspline.rim_thickness_mm = LM_REAL(1.2);
  large.support.ring_stiffness_N_mm2 *= 16;
  large = completed(large);
  evaluate(&small, 0, at_small, 2);
  angle[0] = (double)point[0].total_rad;
  angle[1] = (double)point[1].total_rad;
  evaluate(&large, 0, at_large, 2);
  for (i = 0; i < 2; i++) {
    ASSERT_NEAR(BOUND(1e-9, 2e-5) * angle[i], angle[i], point[i].total_rad);
  }
}

/* Pair compliance from eq (6) when the designer gives none; both gears and both deformations. The
 * energy integral at the real contacts gives 4.3 .. 7.3e-6 mm/N for reference A. */
TEST(pairs_give_by_the_energy_integral) {
  lm_drive drive = calibrated();
  const lm_real torque[] = {40};
  lm_real given;
  evaluate(&drive, 0, torque, 1);
  given = point[0].tooth_bending_rad;
  drive.support.tooth_compliance_mm_per_N = 0;
  evaluate(&drive, 0, torque, 1);
  TEST_ASSERT_TRUE(point[0].tooth_bending_rad > LM_REAL(0.8) * given);
  TEST_ASSERT_TRUE(point[0].tooth_bending_rad < LM_REAL(2.5) * given);
  drive = completed(reference_e());
  evaluate(&drive, 0, torque, 1);
  TEST_ASSERT_TRUE(point[0].tooth_bending_rad > 0);
  TEST_ASSERT_TRUE(point[0].tooth_bending_rad < LM_REAL(0.1) * point[0].total_rad);
}

/* More nodes of the neutral line change nothing: 1e-6 arcmin. */
TEST(refining_the_grid_converges) {
  const lm_drive drive = rich();
  const lm_real torque[] = {-40, 2, 40};
  double total[3];
  int i;
  evaluate(&drive, 0, torque, 3);
  for (i = 0; i < 3; i++) {
    total[i] = in_arcmin(point[i].total_rad);
  }
  TEST_ASSERT_EQUAL(LM_OK, lm_prepare_meshes(&drive, 256, &workspace, &fault));
  TEST_ASSERT_EQUAL(
      LM_OK, lm_evaluate_torsion_curve(&drive, 0, torque, 3, point, &state, &workspace, &fault));
  for (i = 0; i < 3; i++) {
    ASSERT_NEAR(BOUND(2e-6, 2e-3), total[i], in_arcmin(point[i].total_rad));
  }
}

TEST(nonsense_is_refused) {
  lm_drive drive = calibrated();
  lm_real torque[2] = {1, 2};
  lm_real result = 0;
  lm_status (*const f)(const lm_drive *, lm_real, const lm_real[], int, lm_contributions[],
                       lm_mesh_state *, lm_design_workspace *, lm_fault *) =
      lm_evaluate_torsion_curve;
  evaluate(&drive, 0, torque, 2);
  TEST_ASSERT_EQUAL(LM_NULL, lm_prepare_meshes(0, 64, &workspace, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_prepare_meshes(&drive, 64, 0, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, f(0, 0, torque, 2, point, 0, &workspace, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, f(&drive, 0, 0, 2, point, 0, &workspace, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, f(&drive, 0, torque, 2, 0, 0, &workspace, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, f(&drive, 0, torque, 2, point, 0, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, f(&drive, 0, torque, 0, point, 0, &workspace, &fault));
  TEST_ASSERT_EQUAL_STRING("count", fault.input);
  TEST_ASSERT_EQUAL(LM_NOT_FINITE,
                    f(&drive, (lm_real)NAN, torque, 2, point, 0, &workspace, &fault));
  TEST_ASSERT_EQUAL_STRING("phase_rad", fault.input);
  torque[1] = 1;
  TEST_ASSERT_EQUAL(LM_NOT_MONOTONE, f(&drive, 0, torque, 2, point, 0, &workspace, &fault));
  torque[1] = LM_REAL(2e6); /* beyond what the chains accept */
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, f(&drive, 0, torque, 2, point, 0, &workspace, &fault));
  TEST_ASSERT_EQUAL_STRING("torque_Nm", fault.input);
  TEST_ASSERT_EQUAL(LM_NULL, lm_reversal_lost_motion(&drive, 0, 1, 0, &workspace, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_reversal_lost_motion(&drive, 0, 0, &result, &workspace, &fault));
  TEST_ASSERT_EQUAL_STRING("torque_Nm", fault.input);
  TEST_ASSERT_EQUAL(LM_NULL, lm_reversal_lost_motion(0, 0, 1, &result, &workspace, &fault));
  TEST_ASSERT_TRUE(result == 0);
}

/* Refusals of the parts are passed on with their own texts. */
TEST(refusals_of_the_parts_come_through) {
  const lm_real torque[] = {1};
  const lm_drive good = calibrated();
  lm_drive drive = good;
  evaluate(&good, 0, torque, 1);
  drive.support.ring_stiffness_N_mm2 = 0;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_evaluate_torsion_curve(&drive, 0, torque, 1, point, 0, &workspace, &fault));
  TEST_ASSERT_EQUAL_STRING("support.ring_stiffness_N_mm2", fault.input);
  drive = good;
  drive.gap.generator_mm = LM_REAL(200);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_evaluate_torsion_curve(&drive, 0, torque, 1, point, 0, &workspace, &fault));
  drive = good;
  drive.gap.ring_stiffness_N_per_mm = 0;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_evaluate_torsion_curve(&drive, 0, torque, 1, point, 0, &workspace, &fault));
  drive = good;
  drive.torsion[0].ratio = 0;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_evaluate_torsion_curve(&drive, 0, torque, 1, point, 0, &workspace, &fault));
  drive = good;
  drive.radial_law_count = 1;
  drive.radial_laws[0].exponent = LM_REAL(9);
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE,
                    lm_evaluate_torsion_curve(&drive, 0, torque, 1, point, 0, &workspace, &fault));
  drive = good;
  drive.support.engagement_limit_rad = LM_REAL(-1);
  TEST_ASSERT_EQUAL(LM_NO_CONTACT,
                    lm_evaluate_torsion_curve(&drive, 0, torque, 1, point, 0, &workspace, &fault));
  TEST_ASSERT_EQUAL_STRING("teeth.engagement_depth", fault.input);
  drive = good;
  drive.axial_sections = 8;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_prepare_meshes(&drive, 64, &workspace, &fault));
  TEST_ASSERT_EQUAL_STRING("drive.axial_sections", fault.input);
  drive = good;
  drive.teeth.engagement_depth = LM_REAL(30);
  TEST_ASSERT_EQUAL(LM_INCONSISTENT, lm_prepare_meshes(&drive, 64, &workspace, &fault));
  drive = good;
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_prepare_meshes(&drive, 7, &workspace, &fault));
  TEST_ASSERT_EQUAL_STRING("nodes", fault.input);
}

/* The largest drive: 640 teeth, ratio 320, seven sections, two unlike lobes. With usual limits, and
 * with limits that make candidates of all pairs that reach each other. */
TEST(the_largest_drive_has_room) {
  lm_real torque[9];
  int wide;
  even_torques(torque, 9, 80);
  for (wide = 0; wide < 2; wide++) {
    lm_drive drive = reference_a();
    int i;
    drive.ratio = LM_REAL(320);
    drive.teeth.module_mm = LM_REAL(0.25) * 200 / 640;
    drive.teeth.flexspline_teeth = 640;
    drive.teeth.rigid_teeth = 642;
    drive.generator.deflection_mm = LM_REAL(0.2375) * 200 / 640;
    drive.axial_sections = 7;
    drive.generator.floating = 0;
    drive.generator.eccentricity_mm = LM_REAL(0.001);
    if (wide) {
      drive.support.gap_limit_rad = LM_REAL(600) * ARCMIN;
      drive.support.engagement_limit_rad = HALF_PI;
    }
    drive = completed(drive);
    TEST_ASSERT_EQUAL(LM_OK, lm_check_drive(&drive, &fault));
    evaluate(&drive, 0, torque, 9);
    TEST_ASSERT_TRUE(state.pairs > 2000);
    for (i = 1; i < 9; i++) {
      TEST_ASSERT_TRUE(point[i].total_rad > point[i - 1].total_rad);
    }
  }
}

/* Gears with an invalid material: the energy integral states which gear, for both gears and both
 * deformations. */
TEST(pairs_without_a_compliance_are_refused) {
  const lm_real torque[] = {1};
  int d;
  int bad;
  for (d = 0; d < 2; d++) {
    const lm_drive good = completed(d == 0 ? reference_a() : reference_e());
    for (bad = 0; bad < 3; bad++) {
      lm_drive drive = good;
      if (bad == 0) {
        drive.material.youngs_modulus_MPa = 0;
      } else if (bad == 1) {
        drive.teeth.flexspline_shift = LM_REAL(50);
      } else {
        drive.teeth.rigid_shift = LM_REAL(50);
      }
      TEST_ASSERT_EQUAL(LM_OK, lm_prepare_meshes(&good, LM_NEUTRAL_LINE_NODES, &workspace, &fault));
      TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_evaluate_torsion_curve(&drive, 0, torque, 1, point, 0,
                                                                   &workspace, &fault));
    }
  }
}

/* Data common to all tooth phases of a drive are computed once, and again for the next drive. */
TEST(phases_one_after_the_other_give_the_bits_of_each_alone) {
  const lm_real torque[] = {-40, LM_REAL(1.6), 40};
  const lm_drive drive[] = {completed(reference_a()), completed(reference_e())};
  lm_contributions alone[3];
  int d;
  int p;
  for (d = 0; d < 2; d++) {
    TEST_ASSERT_EQUAL(LM_OK,
                      lm_prepare_meshes(&drive[d], LM_NEUTRAL_LINE_NODES, &workspace, &fault));
    for (p = 0; p < 4; p++) {
      static lm_design_workspace fresh;
      const lm_real phase = PITCH * LM_REAL(p) / LM_REAL(4);
      memset(&fresh, 0, sizeof fresh);
      TEST_ASSERT_EQUAL(LM_OK, lm_prepare_meshes(&drive[d], LM_NEUTRAL_LINE_NODES, &fresh, &fault));
      TEST_ASSERT_EQUAL(LM_OK, lm_evaluate_torsion_curve(&drive[d], phase, torque, 3, alone, &state,
                                                         &fresh, &fault));
      TEST_ASSERT_EQUAL(LM_OK, lm_evaluate_torsion_curve(&drive[d], phase, torque, 3, point, &state,
                                                         &workspace, &fault));
      TEST_ASSERT_EQUAL_MEMORY(alone, point, sizeof alone);
    }
  }
}

/* A tooth that is pointed below its tip: negative margin of the tip thickness, no compliance.
 */
/* Whether the states of a drive are found without the pairs that are further off. */
static void assert_same_bits_with_near_pairs(const lm_drive *drive, lm_real torque_Nm) {
  const lm_real torque[] = {-torque_Nm, torque_Nm / LM_REAL(20), torque_Nm};
  const lm_real pitch = LM_REAL(2) * LM_PI / LM_REAL(drive->teeth.flexspline_teeth);
  int k;
  for (k = 0; k < 3; k++) {
    const lm_real phase = pitch * LM_REAL(k) / LM_REAL(4);
    lm_contributions all[3];
    int pairs;
    int i;
    evaluate(drive, phase, torque, 3);
    pairs = state.pairs;
    for (i = 0; i < 3; i++) {
      all[i] = point[i];
    }
    workspace.near_only = 1;
    TEST_ASSERT_EQUAL(LM_OK, lm_evaluate_torsion_curve(drive, phase, torque, 3, point, &state,
                                                       &workspace, &fault));
    TEST_ASSERT_EQUAL(pairs, state.pairs);
    for (i = 0; i < 3; i++) {
      TEST_ASSERT_TRUE(all[i].total_rad == point[i].total_rad);
      TEST_ASSERT_TRUE(all[i].stiffness_Nm_per_rad == point[i].stiffness_Nm_per_rad);
      TEST_ASSERT_EQUAL(all[i].forward_teeth, point[i].forward_teeth);
    }
  }
}

/* Also where far pairs carry, as at many times the rated torque: all are computed then. */
TEST(near_pairs_give_the_bits_of_all) {
  lm_drive drive = rich();
  assert_same_bits_with_near_pairs(&drive, LM_REAL(40));
  assert_same_bits_with_near_pairs(&drive, LM_REAL(2000));
  drive.axial_sections = 3;
  assert_same_bits_with_near_pairs(&drive, LM_REAL(40));
}

TEST(pointed_teeth_are_refused_by_their_height) {
  const lm_real torque[] = {1};
  lm_drive drive = reference_a();
  drive.teeth.flexspline_shift = LM_REAL(6);
  drive.teeth.rigid_shift = LM_REAL(5.957);
  drive.teeth.tooth_height = LM_REAL(2.4);
  drive = completed(drive);
  TEST_ASSERT_EQUAL(LM_OK, lm_prepare_meshes(&drive, LM_NEUTRAL_LINE_NODES, &workspace, &fault));
  TEST_ASSERT_EQUAL(LM_INCONSISTENT,
                    lm_evaluate_torsion_curve(&drive, 0, torque, 1, point, 0, &workspace, &fault));
  TEST_ASSERT_EQUAL_STRING("teeth.tooth_height", fault.input);
  TEST_ASSERT_TRUE(fault.found <= 0);
  TEST_ASSERT_EQUAL(LM_INCONSISTENT,
                    lm_evaluate_torsion_curve(&drive, 0, torque, 1, point, 0, &workspace, &fault));
}

/* --- compact curve ---------------------------------------------------------------------------- */

TEST(knots_of_a_straight_line_are_free) {
  lm_real torque[65];
  lm_real angle[65];
  int chosen[16];
  lm_real error;
  int i;
  even_torques(torque, 65, 64);
  for (i = 0; i < 65; i++) {
    angle[i] = torque[i] * LM_REAL(0.125);
  }
  TEST_ASSERT_EQUAL(LM_OK, lm_choose_knots(torque, angle, 65, 16, chosen, &error, &fault));
  ASSERT_NEAR(0, 0, error);
  for (i = 1; i < 16; i++) {
    TEST_ASSERT_TRUE(chosen[i] > chosen[i - 1]);
  }
  TEST_ASSERT_EQUAL(0, chosen[0]);
  TEST_ASSERT_EQUAL(64, chosen[15]);
}

/* The curve of a real drive: the error falls with the knots, is the true largest distance, zero is
 * a knot, and 33 knots keep the size 20 within 0.01 arcmin. */
TEST(knots_follow_the_torsion_curve) {
  static lm_real torque[257];
  static lm_real angle[257];
  const int counts[] = {3, 16, 33, 64, 257};
  const lm_drive drive = calibrated();
  double last = 1;
  int n;
  int i;
  even_torques(torque, 257, 80);
  evaluate(&drive, 0, torque, 257);
  for (i = 0; i < 257; i++) {
    angle[i] = point[i].total_rad;
  }
  for (n = 0; n < 5; n++) {
    int chosen[257];
    lm_real error;
    double largest = 0;
    int has_zero = 0;
    int k = 0;
    TEST_ASSERT_EQUAL(LM_OK,
                      lm_choose_knots(torque, angle, 257, counts[n], chosen, &error, &fault));
    for (i = 0; i < 257; i++) {
      double u;
      k += k < counts[n] - 2 && i >= chosen[k + 1];
      u = ((double)torque[i] - (double)torque[chosen[k]]) /
          ((double)torque[chosen[k + 1]] - (double)torque[chosen[k]]);
      largest = fmax(largest, fabs((double)angle[chosen[k]] +
                                   u * ((double)angle[chosen[k + 1]] - (double)angle[chosen[k]]) -
                                   (double)angle[i]));
      has_zero |= chosen[k] == 128;
    }
    ASSERT_NEAR(BOUND(1e-15, 1e-9), largest, error);
    TEST_ASSERT_TRUE(has_zero);
    TEST_ASSERT_TRUE((double)error < last || last == 0);
    last = (double)error;
    if (counts[n] == 33) {
      TEST_ASSERT_TRUE(in_arcmin(error) < 0.01);
    }
  }
  ASSERT_NEAR(0, 0, last);
}

TEST(samples_that_make_no_curve_are_refused) {
  lm_real torque[] = {-1, 0, 1};
  lm_real angle[] = {-1, 0, 1};
  int chosen[3] = {7, 7, 7};
  lm_real error = 5;
  TEST_ASSERT_EQUAL(LM_NULL, lm_choose_knots(0, angle, 3, 2, chosen, &error, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_choose_knots(torque, 0, 3, 2, chosen, &error, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_choose_knots(torque, angle, 3, 2, 0, &error, &fault));
  TEST_ASSERT_EQUAL(LM_NULL, lm_choose_knots(torque, angle, 3, 2, chosen, 0, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_choose_knots(torque, angle, 3, 1, chosen, &error, &fault));
  TEST_ASSERT_EQUAL(LM_OUT_OF_RANGE, lm_choose_knots(torque, angle, 3, 4, chosen, &error, &fault));
  TEST_ASSERT_EQUAL_STRING("knots", fault.input);
  torque[1] = (lm_real)NAN;
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, lm_choose_knots(torque, angle, 3, 2, chosen, &error, &fault));
  torque[1] = -1;
  TEST_ASSERT_EQUAL(LM_NOT_MONOTONE, lm_choose_knots(torque, angle, 3, 2, chosen, &error, &fault));
  TEST_ASSERT_EQUAL_STRING("torque_Nm", fault.input);
  torque[1] = 0;
  angle[1] = (lm_real)INFINITY;
  TEST_ASSERT_EQUAL(LM_NOT_FINITE, lm_choose_knots(torque, angle, 3, 2, chosen, &error, &fault));
  angle[1] = 2;
  TEST_ASSERT_EQUAL(LM_NOT_MONOTONE, lm_choose_knots(torque, angle, 3, 2, chosen, &error, &fault));
  TEST_ASSERT_EQUAL_STRING("angle_rad", fault.input);
  TEST_ASSERT_EQUAL(7, chosen[0]);
  TEST_ASSERT_TRUE(error == 5);
  angle[1] = 1;
  TEST_ASSERT_EQUAL(LM_OK, lm_choose_knots(torque, angle, 3, 2, chosen, &error, 0));
  ASSERT_NEAR(1e-6, 1, error);
}
