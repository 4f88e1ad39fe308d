#include "lostmotion/tooth_bending.h"

#include "elastic_ranges.h"
#include "real_math.h"
#include "refuse.h"

#define LOAD_ANGLE_MIN LM_REAL(-0.5)
#define PROFILE_POINTS_MAX 4096

/* Positive half of the 16-point Gauss-Legendre rule on [-1, 1]. */
#define GAUSS_HALF 8
static const double gauss_node[GAUSS_HALF] = {
    0.09501250983763744, 0.28160355077925891, 0.45801677765722737, 0.61787624440264375,
    0.75540440835500303, 0.86563120238783174, 0.94457502307323258, 0.98940093499164993};
static const double gauss_weight[GAUSS_HALF] = {
    0.18945061045506850, 0.18260341504492359, 0.16915651939500254, 0.14959598881657673,
    0.12462897125553387, 0.09515851168249278, 0.06225352393864789, 0.02715245941175409};

/* The two integrals of (6): all three terms are multiples of them. */
typedef struct strip_sums {
  lm_real lever_over_cube; /* integral (y0 - y)^2 / (2x)^3 dy, dimensionless */
  lm_real over_thickness;  /* integral 1 / (2x) dy, dimensionless */
} strip_sums;

static void add_strip(strip_sums *sums, lm_real dy, lm_real lever, lm_real thickness) {
  sums->lever_over_cube += dy * lever * lever / (thickness * thickness * thickness);
  sums->over_thickness += dy / thickness;
}

lm_tooth_material lm_steel_tooth_material(void) {
  lm_tooth_material steel;
  steel.youngs_modulus_MPa = LM_REAL(LM_STEEL_YOUNGS_MODULUS_MPA);
  steel.shear_modulus_MPa = LM_REAL(LM_STEEL_SHEAR_MODULUS_MPA);
  steel.poisson_ratio = LM_REAL(LM_STEEL_POISSON_RATIO);
  steel.plane_strain = 0;
  return steel;
}

/* Common inputs of the tooth functions: face width, load angle, elastic constants. */
static lm_status check_tooth_load(lm_real face_width_mm, lm_real load_angle_rad,
                                  const lm_tooth_material *material, lm_fault *fault) {
  if (material == 0) {
    return refuse(fault, LM_NULL, "material");
  }
  {
    const bound bounds[] = {
        {"face_width_mm", face_width_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
        {"load_angle_rad", load_angle_rad, LOAD_ANGLE_MIN, FLANK_ANGLE_MAX},
        {"material.youngs_modulus_MPa", material->youngs_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
        {"material.shear_modulus_MPa", material->shear_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
        {"material.poisson_ratio", material->poisson_ratio, LM_REAL(0), POISSON_MAX},
        {"material.plane_strain", (lm_real)material->plane_strain, LM_REAL(0), LM_REAL(1)},
    };
    return check_bounds(fault, bounds, COUNT_OF(bounds));
  }
}

static void put_tooth(const strip_sums *sums, lm_real face_width, lm_real load_angle,
                      const lm_tooth_material *material, lm_tooth_compliance *compliance) {
  const lm_real c = real_cos(load_angle);
  const lm_real s = real_sin(load_angle);
  const lm_real nu = material->poisson_ratio;
  const lm_real e_width = material->youngs_modulus_MPa * face_width;
  const lm_real g_width = material->shear_modulus_MPa * face_width;
  const lm_real plate = material->plane_strain != 0 ? LM_REAL(1) - nu * nu : LM_REAL(1);
  /* 12 of I = b (2x)^3 / 12; 1.2 is the shear factor of a rectangular section. */
  compliance->bending_mm_per_N = LM_REAL(12) * plate * c * c * sums->lever_over_cube / e_width;
  compliance->shear_mm_per_N = LM_REAL(1.2) * c * c * sums->over_thickness / g_width;
  compliance->axial_mm_per_N = s * s * sums->over_thickness / e_width;
  compliance->total_mm_per_N =
      compliance->bending_mm_per_N + compliance->shear_mm_per_N + compliance->axial_mm_per_N;
}

/* Strip of a tooth whose thickness is linear from one height to the next. */
static void add_trapezoid(strip_sums *sums, lm_real from, lm_real to, lm_real thickness_from,
                          lm_real thickness_to, lm_real load_height) {
  const lm_real half = (to - from) / LM_REAL(2);
  const lm_real middle = (to + from) / LM_REAL(2);
  const lm_real thickness_half = (thickness_to - thickness_from) / LM_REAL(2);
  const lm_real thickness_middle = (thickness_to + thickness_from) / LM_REAL(2);
  int i = 0;
  for (i = 0; i < GAUSS_HALF; ++i) {
    const lm_real node = LM_REAL(gauss_node[i]);
    const lm_real dy = half * LM_REAL(gauss_weight[i]);
    add_strip(sums, dy, load_height - (middle - half * node),
              thickness_middle - thickness_half * node);
    add_strip(sums, dy, load_height - (middle + half * node),
              thickness_middle + thickness_half * node);
  }
}

lm_status lm_tooth_rectangle_compliance(lm_real height_mm, lm_real thickness_mm,
                                        lm_real face_width_mm, lm_real load_angle_rad,
                                        const lm_tooth_material *material,
                                        lm_tooth_compliance *compliance, lm_fault *fault) {
  const bound bounds[] = {
      {"height_mm", height_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"thickness_mm", thickness_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
  };
  lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  strip_sums sums = {LM_REAL(0), LM_REAL(0)};
  if (status == LM_OK) {
    status = check_tooth_load(face_width_mm, load_angle_rad, material, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  if (compliance == 0) {
    return refuse(fault, LM_NULL, "compliance");
  }
  add_trapezoid(&sums, LM_REAL(0), height_mm, thickness_mm, thickness_mm, height_mm);
  put_tooth(&sums, face_width_mm, load_angle_rad, material, compliance);
  return LM_OK;
}

/* Heights rise from zero, thickness everywhere, load within. */
static lm_status check_profile(const lm_real *height, const lm_real *half_thickness, int count,
                               lm_real load_height, lm_fault *fault) {
  lm_status status = LM_OK;
  int i = 0;
  if (height == 0 || half_thickness == 0) {
    return refuse(fault, LM_NULL, "height_mm or half_thickness_mm");
  }
  status = check_range(fault, "count", (lm_real)count, LM_REAL(2), LM_REAL(PROFILE_POINTS_MAX));
  for (i = 0; status == LM_OK && i < count; ++i) {
    const bound bounds[] = {
        {"height_mm", height[i], LM_REAL(0), i == 0 ? LM_REAL(0) : LENGTH_MAX_MM},
        {"half_thickness_mm", half_thickness[i], LENGTH_MIN_MM, LENGTH_MAX_MM},
    };
    status = check_bounds(fault, bounds, COUNT_OF(bounds));
    if (status == LM_OK && i > 0 && !(height[i] > height[i - 1])) {
      status = refuse(fault, LM_NOT_MONOTONE, "height_mm");
    }
  }
  if (status != LM_OK) {
    return status;
  }
  return check_range(fault, "load_height_mm", load_height, LENGTH_MIN_MM, height[count - 1]);
}

lm_status lm_tooth_profile_compliance(const lm_real *height_mm, const lm_real *half_thickness_mm,
                                      int count, lm_real load_height_mm, lm_real face_width_mm,
                                      lm_real load_angle_rad, const lm_tooth_material *material,
                                      lm_tooth_compliance *compliance, lm_fault *fault) {
  lm_status status = check_profile(height_mm, half_thickness_mm, count, load_height_mm, fault);
  strip_sums sums = {LM_REAL(0), LM_REAL(0)};
  int i = 0;
  if (status == LM_OK) {
    status = check_tooth_load(face_width_mm, load_angle_rad, material, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  if (compliance == 0) {
    return refuse(fault, LM_NULL, "compliance");
  }
  for (i = 0; height_mm[i] < load_height_mm; ++i) {
    /* The strip that contains the load ends there. The load lies within the samples, so the loop
     * ends before the last one is passed. */
    const lm_real end = height_mm[i + 1] < load_height_mm ? height_mm[i + 1] : load_height_mm;
    const lm_real along = (end - height_mm[i]) / (height_mm[i + 1] - height_mm[i]);
    const lm_real below = LM_REAL(2) * half_thickness_mm[i];
    const lm_real above = LM_REAL(2) * half_thickness_mm[i + 1];
    add_trapezoid(&sums, height_mm[i], end, below, below + along * (above - below), load_height_mm);
  }
  put_tooth(&sums, face_width_mm, load_angle_rad, material, compliance);
  return LM_OK;
}

/* Position of a sample in its panel, 0 .. 1: the positive nodes, then the negative ones. */
static lm_real place_in_panel(int sample) {
  const lm_real offset = LM_REAL(0.5) * LM_REAL(gauss_node[sample % GAUSS_HALF]);
  return LM_REAL(0.5) + ((sample / GAUSS_HALF) % 2 == 0 ? -offset : offset);
}

/* In the lower panel the height grows with the square of the position: a fillet is tangential to
 * the root, where the slope of the thickness by the height is infinite. */
lm_real lm_tooth_sample_height(int sample, lm_real fillet_share) {
  const lm_real place = place_in_panel(sample);
  return sample < 2 * GAUSS_HALF ? fillet_share * place * place
                                 : fillet_share + (LM_REAL(1) - fillet_share) * place;
}

/* Weight of a sample: the derivative of its height by its position, times that of Gauss. */
static lm_real sample_weight(int sample, lm_real fillet_share) {
  const lm_real slope = sample < 2 * GAUSS_HALF ? LM_REAL(2) * fillet_share * place_in_panel(sample)
                                                : LM_REAL(1) - fillet_share;
  return LM_REAL(0.5) * slope * LM_REAL(gauss_weight[sample % GAUSS_HALF]);
}

lm_status lm_tooth_outline_compliance(const lm_real half_thickness_mm[LM_TOOTH_SAMPLES],
                                      lm_real fillet_share, lm_real load_height_mm,
                                      lm_real face_width_mm, lm_real load_angle_rad,
                                      const lm_tooth_material *material,
                                      lm_tooth_compliance *compliance, lm_fault *fault) {
  strip_sums sums = {LM_REAL(0), LM_REAL(0)};
  lm_status status;
  int i;
  if (half_thickness_mm == 0 || compliance == 0) {
    return refuse(fault, LM_NULL, "half_thickness_mm, compliance");
  }
  status = check_range(fault, "load_height_mm", load_height_mm, LENGTH_MIN_MM, LENGTH_MAX_MM);
  if (status == LM_OK) {
    status = check_range(fault, "fillet_share", fillet_share, LM_REAL(0), LM_REAL(1));
  }
  if (status == LM_OK) {
    status = check_tooth_load(face_width_mm, load_angle_rad, material, fault);
  }
  for (i = 0; i < LM_TOOTH_SAMPLES && status == LM_OK; i++) {
    const lm_real below = load_height_mm * (LM_REAL(1) - lm_tooth_sample_height(i, fillet_share));
    status =
        check_range(fault, "half_thickness_mm", half_thickness_mm[i], LENGTH_MIN_MM, LENGTH_MAX_MM);
    add_strip(&sums, load_height_mm * sample_weight(i, fillet_share), below,
              LM_REAL(2) * half_thickness_mm[i]);
  }
  if (status == LM_OK) {
    put_tooth(&sums, face_width_mm, load_angle_rad, material, compliance);
  }
  return status;
}

/* Pressure angle and involute function at a radius; both zero below the base circle, where the
 * flank continues radially. atan of the tangent is accurate where acos of a number near one loses
 * digits. */
static lm_real involute_at(lm_real base_radius, lm_real radius, lm_real *pressure_angle) {
  lm_real tangent = LM_REAL(0);
  *pressure_angle = LM_REAL(0);
  if (!(radius > base_radius)) {
    return LM_REAL(0);
  }
  tangent = real_sqrt((radius - base_radius) * (radius + base_radius)) / base_radius;
  *pressure_angle = real_atan(tangent);
  return tangent - *pressure_angle;
}

static lm_real tooth_half_angle(const lm_involute_tooth *tooth, lm_real radius,
                                lm_real *pressure_angle) {
  const lm_real involute = involute_at(tooth->base_radius_mm, radius, pressure_angle);
  return tooth->base_half_angle_rad + (tooth->side == LM_TOOTH_OUTWARD ? -involute : involute);
}

static lm_status check_involute_tooth(const lm_involute_tooth *tooth, lm_fault *fault) {
  if (tooth == 0) {
    return refuse(fault, LM_NULL, "tooth");
  }
  {
    const bound bounds[] = {
        {"tooth.side", (lm_real)(int)tooth->side, LM_REAL(LM_TOOTH_OUTWARD),
         LM_REAL(LM_TOOTH_INWARD)},
        {"tooth.base_radius_mm", tooth->base_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
        {"tooth.base_half_angle_rad", tooth->base_half_angle_rad, -LM_PI, LM_PI},
        {"tooth.root_radius_mm", tooth->root_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
    };
    return check_bounds(fault, bounds, COUNT_OF(bounds));
  }
}

lm_status lm_make_involute_tooth(lm_tooth_side side, lm_real module_mm, int teeth, lm_real shift,
                                 lm_real pressure_angle_rad, lm_real root_radius_mm,
                                 lm_involute_tooth *tooth, lm_fault *fault) {
  const bound bounds[] = {
      {"module_mm", module_mm, LM_REAL(0.01), LM_REAL(100)},
      {"teeth", (lm_real)teeth, LM_REAL(10), LM_REAL(2000)},
      {"shift", shift, LM_REAL(-20), LM_REAL(20)},
      {"pressure_angle_rad", pressure_angle_rad, LM_REAL(0.1), LM_REAL(0.8)},
  };
  lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_involute_tooth made;
  lm_real z = LM_REAL(0);
  lm_real tangent = LM_REAL(0);
  lm_real sum = LM_REAL(0);
  lm_real unused = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (tooth == 0) {
    return refuse(fault, LM_NULL, "tooth");
  }
  z = (lm_real)teeth;
  tangent = real_tan(pressure_angle_rad);
  sum =
      LM_PI / (LM_REAL(2) * z) + LM_REAL(2) * shift * tangent / z + (tangent - pressure_angle_rad);
  made.side = side;
  made.base_radius_mm = module_mm * z / LM_REAL(2) * real_cos(pressure_angle_rad);
  made.base_half_angle_rad = side == LM_TOOTH_OUTWARD ? sum : LM_PI / z - sum;
  made.root_radius_mm = root_radius_mm;
  status = check_involute_tooth(&made, fault);
  if (status != LM_OK) {
    return status;
  }
  if (!(tooth_half_angle(&made, root_radius_mm, &unused) > LM_REAL(0))) {
    return refuse(fault, LM_INCONSISTENT, "tooth thickness at root_radius_mm");
  }
  *tooth = made;
  return LM_OK;
}

lm_status lm_involute_load_angle(const lm_involute_tooth *tooth, lm_real radius_mm,
                                 lm_real *angle_rad, lm_fault *fault) {
  lm_status status = check_involute_tooth(tooth, fault);
  lm_real pressure_angle = LM_REAL(0);
  lm_real half_angle = LM_REAL(0);
  if (status == LM_OK) {
    status = check_range(fault, "radius_mm", radius_mm, tooth->base_radius_mm, LENGTH_MAX_MM);
  }
  if (status != LM_OK) {
    return status;
  }
  if (angle_rad == 0) {
    return refuse(fault, LM_NULL, "angle_rad");
  }
  half_angle = tooth_half_angle(tooth, radius_mm, &pressure_angle);
  *angle_rad = pressure_angle + (tooth->side == LM_TOOTH_OUTWARD ? -half_angle : half_angle);
  return LM_OK;
}

/* The loaded radius lies beyond the root on the tooth's side, and the tooth is not yet pointed
 * there. Towards the root an involute tooth only gets thicker in angle, so that is enough. */
static lm_status check_loaded_radius(const lm_involute_tooth *tooth, lm_real loaded_radius,
                                     lm_fault *fault) {
  lm_status status = check_involute_tooth(tooth, fault);
  lm_real unused = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (tooth->side == LM_TOOTH_OUTWARD) {
    status = check_range(fault, "loaded_radius_mm", loaded_radius,
                         tooth->root_radius_mm + LENGTH_MIN_MM, LENGTH_MAX_MM);
  } else {
    status = check_range(fault, "loaded_radius_mm", loaded_radius, LENGTH_MIN_MM,
                         tooth->root_radius_mm - LENGTH_MIN_MM);
  }
  if (status != LM_OK) {
    return status;
  }
  if (!(tooth_half_angle(tooth, loaded_radius, &unused) > LM_REAL(0))) {
    return refuse(fault, LM_INCONSISTENT, "tooth thickness at loaded_radius_mm");
  }
  return LM_OK;
}

/* From the base circle (or the end of the tooth next to it) to a radius on either side. The
 * substitution radius = joint + length t^2 (3 - 2t) concentrates the points at both ends: at the
 * base circle, where the involute function starts with the power 3/2, and at a thin tip. Two Gauss
 * panels in t. dy is positive for both directions of the tooth. */
static void add_involute_span(strip_sums *sums, const lm_involute_tooth *tooth, lm_real joint,
                              lm_real end, lm_real loaded_radius) {
  const lm_real length = end - joint;
  int i = 0;
  for (i = 0; i < 4 * GAUSS_HALF; ++i) {
    const int k = i % GAUSS_HALF;
    const lm_real middle = LM_REAL(i < 2 * GAUSS_HALF ? 0.25 : 0.75);
    const lm_real offset = LM_REAL(0.25) * LM_REAL(gauss_node[k]);
    const lm_real t = (i / GAUSS_HALF) % 2 == 0 ? middle - offset : middle + offset;
    const lm_real radius = joint + length * t * t * (LM_REAL(3) - LM_REAL(2) * t);
    const lm_real dy =
        real_fabs(length) * LM_REAL(1.5) * t * (LM_REAL(1) - t) * LM_REAL(gauss_weight[k]);
    lm_real unused = LM_REAL(0);
    add_strip(sums, dy, loaded_radius - radius,
              LM_REAL(2) * radius * tooth_half_angle(tooth, radius, &unused));
  }
}

/* Clipped to the range between two ends in any order. */
static lm_real clamp_between(lm_real value, lm_real a, lm_real b) {
  const lm_real low = a < b ? a : b;
  const lm_real high = a < b ? b : a;
  if (value < low) {
    return low;
  }
  return value > high ? high : value;
}

lm_status lm_involute_tooth_compliance(const lm_involute_tooth *tooth, lm_real loaded_radius_mm,
                                       lm_real face_width_mm, lm_real load_angle_rad,
                                       const lm_tooth_material *material,
                                       lm_tooth_compliance *compliance, lm_fault *fault) {
  lm_status status = check_loaded_radius(tooth, loaded_radius_mm, fault);
  strip_sums sums = {LM_REAL(0), LM_REAL(0)};
  lm_real joint = LM_REAL(0);
  if (status == LM_OK) {
    status = check_tooth_load(face_width_mm, load_angle_rad, material, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  if (compliance == 0) {
    return refuse(fault, LM_NULL, "compliance");
  }
  /* The flank has a joint at the base circle. If that is outside the tooth, one span is empty. */
  joint = clamp_between(tooth->base_radius_mm, tooth->root_radius_mm, loaded_radius_mm);
  add_involute_span(&sums, tooth, joint, tooth->root_radius_mm, loaded_radius_mm);
  add_involute_span(&sums, tooth, joint, loaded_radius_mm, loaded_radius_mm);
  put_tooth(&sums, face_width_mm, load_angle_rad, material, compliance);
  return LM_OK;
}

lm_status lm_foundation_compliance(lm_real load_height_mm, lm_real root_thickness_mm,
                                   lm_real face_width_mm, lm_real load_angle_rad,
                                   const lm_tooth_material *material, lm_real *compliance_mm_per_N,
                                   lm_fault *fault) {
  const bound bounds[] = {
      {"load_height_mm", load_height_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"root_thickness_mm", root_thickness_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
  };
  lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real slenderness = LM_REAL(0);
  lm_real nu = LM_REAL(0);
  lm_real c = LM_REAL(0);
  lm_real s = LM_REAL(0);
  lm_real plate = LM_REAL(0);
  if (status == LM_OK) {
    status = check_tooth_load(face_width_mm, load_angle_rad, material, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  if (compliance_mm_per_N == 0) {
    return refuse(fault, LM_NULL, "compliance_mm_per_N");
  }
  slenderness = load_height_mm / root_thickness_mm;
  nu = material->poisson_ratio;
  c = real_cos(load_angle_rad);
  s = real_sin(load_angle_rad);
  plate = LM_REAL(1) - nu * nu;
  *compliance_mm_per_N =
      plate / (face_width_mm * material->youngs_modulus_MPa) *
      (c * c *
           (LM_REAL(5.306) * slenderness * slenderness +
            LM_REAL(2) * (LM_REAL(1) - nu - LM_REAL(2) * nu * nu) / plate * slenderness +
            LM_REAL(1.534)) +
       LM_REAL(1.534) * LM_REAL(0.4167) * s * s / (LM_REAL(1) + nu));
  return LM_OK;
}

lm_status lm_involute_foundation_compliance(const lm_involute_tooth *tooth,
                                            lm_real loaded_radius_mm, lm_real face_width_mm,
                                            lm_real load_angle_rad,
                                            const lm_tooth_material *material,
                                            lm_real *compliance_mm_per_N, lm_fault *fault) {
  const lm_status status = check_loaded_radius(tooth, loaded_radius_mm, fault);
  lm_real unused = LM_REAL(0);
  lm_real thickness = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  thickness =
      LM_REAL(2) * tooth->root_radius_mm * tooth_half_angle(tooth, tooth->root_radius_mm, &unused);
  return lm_foundation_compliance(real_fabs(loaded_radius_mm - tooth->root_radius_mm), thickness,
                                  face_width_mm, load_angle_rad, material, compliance_mm_per_N,
                                  fault);
}

lm_status lm_line_contact_half_width(lm_real force_N, lm_real relative_radius_mm,
                                     lm_real face_width_mm, const lm_tooth_material *material,
                                     lm_real *half_width_mm, lm_fault *fault) {
  const bound bounds[] = {
      {"force_N", force_N, LM_REAL(0), FORCE_MAX_N},
      {"relative_radius_mm", relative_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
  };
  lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status == LM_OK) {
    status = check_tooth_load(face_width_mm, LM_REAL(0), material, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  if (half_width_mm == 0) {
    return refuse(fault, LM_NULL, "half_width_mm");
  }
  *half_width_mm = real_sqrt(LM_REAL(8) * force_N * relative_radius_mm *
                             (LM_REAL(1) - material->poisson_ratio * material->poisson_ratio) /
                             (LM_PI * face_width_mm * material->youngs_modulus_MPa));
  return LM_OK;
}

lm_status lm_line_contact_compliance(lm_real depth1_mm, lm_real depth2_mm, lm_real half_width_mm,
                                     lm_real face_width_mm, const lm_tooth_material *material,
                                     lm_real *compliance_mm_per_N, lm_fault *fault) {
  const bound bounds[] = {
      {"depth1_mm", depth1_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"depth2_mm", depth2_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"half_width_mm", half_width_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
  };
  lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real nu = LM_REAL(0);
  if (status == LM_OK) {
    status = check_tooth_load(face_width_mm, LM_REAL(0), material, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  /* Inside this limit the bracket is at least ln 4 - nu / (1 - nu) > 0.4. */
  if (half_width_mm > depth1_mm || half_width_mm > depth2_mm) {
    return refuse(fault, LM_INCONSISTENT, "half_width_mm");
  }
  if (compliance_mm_per_N == 0) {
    return refuse(fault, LM_NULL, "compliance_mm_per_N");
  }
  nu = material->poisson_ratio;
  *compliance_mm_per_N =
      LM_REAL(2) * (LM_REAL(1) - nu * nu) / (LM_PI * material->youngs_modulus_MPa * face_width_mm) *
      (real_log(LM_REAL(4) * (depth1_mm / half_width_mm) * (depth2_mm / half_width_mm)) -
       nu / (LM_REAL(1) - nu));
  return LM_OK;
}

lm_status lm_tooth_bending_angle(lm_real deflection_mm, lm_real radius_mm, lm_real flank_angle_rad,
                                 lm_real *angle_rad, lm_fault *fault) {
  const bound bounds[] = {
      {"deflection_mm", deflection_mm, -DISPLACEMENT_MAX_MM, DISPLACEMENT_MAX_MM},
      {"radius_mm", radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"flank_angle_rad", flank_angle_rad, LM_REAL(0), FLANK_ANGLE_MAX},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  if (angle_rad == 0) {
    return refuse(fault, LM_NULL, "angle_rad");
  }
  *angle_rad = deflection_mm / (radius_mm * real_cos(flank_angle_rad));
  return LM_OK;
}
