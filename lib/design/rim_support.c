#include "lostmotion/rim_support.h"

#include "half_turn.h"
#include "lostmotion/shape.h"
#include "real_math.h"
#include "refuse.h"

/* Stribeck: the most loaded ball of a bearing with rigid rings carries 4.37 F / Z. */
#define STRIBECK LM_REAL(4.37)

/* A cam's pressure points outwards within 45 deg of the axis. */
#define CAM_ARC (LM_PI / LM_REAL(4))

/* Number of support points on the arc of a disc or a ring. */
#define ARC_POINTS 7

/* Two rollers nearer than this to the axis are one, rad. */
#define ONE_ROLLER LM_REAL(0.02)

/* Palmgren, roller between two bodies: 7.68e-5 Q^0.9 l^-0.8. */
#define ROLLER_COEFFICIENT LM_REAL(7.68e-5)

lm_real lm_free_ring_yield(lm_real radius_mm, lm_real stiffness_N_mm2, lm_real angle_rad) {
  const lm_real a = real_fabs(fold_half_turn(angle_rad));
  return radius_mm * radius_mm * radius_mm / (LM_REAL(4) * stiffness_N_mm2) *
         (real_sin(a) + (HALF_PI - a) * real_cos(a) - LM_REAL(4) / LM_PI);
}

lm_real lm_ball_compliance(lm_real ball_diameter_mm, lm_real force_N) {
  return LM_REAL(4.36e-4 * 2 / 3) / real_pow(ball_diameter_mm * force_N, LM_REAL(1) / LM_REAL(3));
}

/* Supports of the rim and their compliance. */
typedef struct supports {
  int count;
  lm_real angle_rad[LM_SUPPORTS_MAX];
  lm_real own_mm_per_N;    /* of each point */
  lm_real common_mm_per_N; /* of the body that carries all points, along the axis */
} supports;

/* Radial force of the wave generator on a lobe at rated torque: the force that bends rim and race
 * to the wave, plus that of the teeth. */
static lm_real lobe_force(const lm_drive *drive, const lm_mesh *mesh) {
  const lm_real r = mesh->geometry.neutral_mm;
  return lm_shape_generator_force(&mesh->line.shape) * drive->support.ring_stiffness_N_mm2 *
             drive->generator.deflection_mm / (r * r * r) +
         drive->rated_torque_Nm * LM_MM_PER_M / (LM_REAL(2) * r) *
             real_tan(drive->teeth.pressure_angle_rad);
}

/* For a bearing with rigid rings: the deflection of the most loaded ball is the displacement of the
 * ring. */
static lm_real bearing_compliance(const lm_support *support, lm_real force_N) {
  const lm_real share = STRIBECK / LM_REAL(support->balls);
  return share * lm_ball_compliance(support->ball_diameter_mm, share * force_N);
}

static void hold_by_balls(const lm_drive *drive, lm_real force_N, supports *held) {
  const lm_real pitch = LM_REAL(2) * LM_PI / LM_REAL(drive->support.balls);
  const int each_side = (int)(CAM_ARC / pitch);
  int k;
  held->count = 2 * each_side + 1;
  for (k = 0; k < held->count; k++) {
    held->angle_rad[k] = pitch * LM_REAL(k - each_side);
  }
  held->own_mm_per_N =
      lm_ball_compliance(drive->support.ball_diameter_mm, force_N / LM_REAL(held->count));
}

/* Rim and race are in full contact with the arc; its body moves in its bearing. */
static void hold_by_arc(const lm_drive *drive, const lm_mesh *mesh, lm_real force_N,
                        supports *held) {
  const lm_real beta = mesh->line.shape.contact_half_angle_rad;
  const lm_real length = LM_REAL(2) * beta * mesh->geometry.neutral_mm / LM_REAL(ARC_POINTS);
  int k;
  held->count = ARC_POINTS;
  for (k = 0; k < ARC_POINTS; k++) {
    held->angle_rad[k] = beta * (LM_REAL(2 * k) / LM_REAL(ARC_POINTS - 1) - LM_REAL(1));
  }
  held->own_mm_per_N = (drive->flexspline.rim_thickness_mm + drive->support.race_thickness_mm) /
                       (drive->material.youngs_modulus_MPa * drive->teeth.face_width_mm * length);
  held->common_mm_per_N = bearing_compliance(&drive->support, force_N);
}

static void hold_by_rollers(const lm_drive *drive, const lm_mesh *mesh, lm_real force_N,
                            supports *held) {
  const lm_real beta = mesh->line.shape.contact_half_angle_rad;
  const int one = beta < ONE_ROLLER;
  const lm_real each = one ? force_N : force_N / (LM_REAL(2) * real_cos(beta));
  held->count = one ? 1 : 2;
  held->angle_rad[0] = one ? LM_REAL(0) : -beta;
  held->angle_rad[1] = beta;
  held->own_mm_per_N = bearing_compliance(&drive->support, each) +
                       LM_REAL(0.9) * ROLLER_COEFFICIENT / real_pow(each, LM_REAL(0.1)) /
                           real_pow(drive->teeth.face_width_mm, LM_REAL(0.8));
}

static void find_supports(const lm_drive *drive, const lm_mesh *mesh, supports *held) {
  const lm_real force = lobe_force(drive, mesh);
  held->common_mm_per_N = LM_REAL(0);
  switch (drive->generator.type) {
    case LM_DISCS:
    case LM_RING:
      hold_by_arc(drive, mesh, force, held);
      break;
    case LM_ROLLERS:
      hold_by_rollers(drive, mesh, force, held);
      break;
    case LM_COSINE:
    case LM_ELLIPSE:
    default:
      hold_by_balls(drive, force, held);
      break;
  }
}

/* The support forces reduce the deflection of the free ring: let G be its deflection at a tooth
 * under a unit force there, g its deflections at the supports, and M the compliance of the supports
 * (the ring's plus their own). The deflection at the tooth is G - g M^-1 g. With M = L L^T that is
 * G - v v, v = L^-1 g. */
lm_status lm_make_rim_support(const lm_drive *drive, const lm_mesh *mesh,
                              const lm_clearance teeth[], int first, int last,
                              lm_foundation *foundation, lm_fault *fault) {
  lm_real factor[LM_SUPPORTS_MAX][LM_SUPPORTS_MAX];
  lm_real radius;
  lm_real stiffness;
  lm_real root;
  supports held;
  int i;
  int j;
  int k;
  if (drive == 0 || mesh == 0 || teeth == 0 || foundation == 0) {
    return refuse(fault, LM_NULL, "drive, mesh, teeth, foundation");
  }
  if (first < 0 || first > last || last >= LM_LOBE_TEETH_MAX) {
    return refuse_range(fault, "teeth", LM_REAL(last), LM_REAL(first),
                        LM_REAL(LM_LOBE_TEETH_MAX - 1));
  }
  radius = mesh->geometry.neutral_mm;
  stiffness = drive->support.ring_stiffness_N_mm2;
  root = real_sqrt(drive->support.ring_factor);
  find_supports(drive, mesh, &held);
  for (i = 0; i < held.count; i++) {
    for (j = 0; j <= i; j++) {
      lm_real sum =
          lm_free_ring_yield(radius, stiffness, held.angle_rad[i] - held.angle_rad[j]) +
          held.common_mm_per_N * real_cos(held.angle_rad[i]) * real_cos(held.angle_rad[j]);
      if (i == j) {
        sum += held.own_mm_per_N;
      }
      for (k = 0; k < j; k++) {
        sum -= factor[i][k] * factor[j][k];
      }
      factor[i][j] = i == j ? real_sqrt(sum) : sum / factor[j][j];
    }
  }
  for (i = 0; i <= last - first; i++) {
    foundation->yield_mm_per_N[i] =
        drive->support.ring_factor *
        lm_free_ring_yield(radius, stiffness, teeth[i].angle_rad - teeth[0].angle_rad);
  }
  for (i = first; i <= last; i++) {
    lm_real *hold = foundation->hold[i];
    const lm_real angle = teeth[i].angle_rad;
    for (j = 0; j < held.count; j++) {
      lm_real sum = root * lm_free_ring_yield(radius, stiffness, angle - held.angle_rad[j]);
      for (k = 0; k < j; k++) {
        sum -= factor[j][k] * hold[k];
      }
      hold[j] = sum / factor[j][j];
    }
  }
  foundation->supports = held.count;
  return LM_OK;
}
