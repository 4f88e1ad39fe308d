#include "lostmotion/compliance.h"

#include "real_math.h"
#include "refuse.h"

/* Plausible sizes of a drive with room on both sides; inside them no intermediate result leaves the
 * range of float32. */
#define LENGTH_MIN_MM LM_REAL(1e-4)
#define LENGTH_MAX_MM LM_REAL(1e4)
#define FORCE_MAX_N LM_REAL(1e7)
#define TORQUE_MAX_NM LM_REAL(1e6)
#define DISPLACEMENT_MAX_MM LM_REAL(100)
#define FLANK_ANGLE_MIN LM_REAL(0.01) /* where the tangent divides */
#define FLANK_ANGLE_MAX LM_REAL(1.4)
#define LOAD_ANGLE_MIN LM_REAL(-0.5)
#define CONTACT_ANGLE_MAX LM_REAL(1.2)
#define MODULUS_MAX_MPA LM_REAL(1e7)
#define POISSON_MAX LM_REAL(0.49)
#define STIFFNESS_MIN LM_REAL(1e-6)
#define STIFFNESS_MAX LM_REAL(1e15)
#define RATIO_MIN LM_REAL(1e-3)
#define RATIO_MAX LM_REAL(1e5)
#define PRELOAD_MAX_N LM_REAL(1e6)
#define CHAIN_MAX 64
#define PROFILE_POINTS_MAX 4096
#define NMM_PER_NM LM_REAL(1000)

/* Deflection of a ring under two opposite point forces, each side, in F R^3 / (E I):
 * 0.07439. */
#define RING_POINT_LOAD ((LM_PI / LM_REAL(4) - LM_REAL(2) / LM_PI) / LM_REAL(2))

typedef struct bound {
  const char *input;
  lm_real found;
  lm_real low;
  lm_real high;
} bound;

#define COUNT_OF(array) ((int)(sizeof(array) / sizeof((array)[0])))

/* The first value outside its range decides. */
static lm_status check_bounds(lm_fault *fault, const bound *bounds, int count) {
  int i = 0;
  for (i = 0; i < count; ++i) {
    const lm_status status =
        check_range(fault, bounds[i].input, bounds[i].found, bounds[i].low, bounds[i].high);
    if (status != LM_OK) {
      return status;
    }
  }
  return LM_OK;
}

static lm_status check_array(lm_fault *fault, const char *input, const void *array, int count) {
  if (array == 0 && count != 0) {
    return refuse(fault, LM_NULL, input);
  }
  return check_range(fault, "count", (lm_real)count, LM_REAL(0), LM_REAL(CHAIN_MAX));
}

/* ---- Radial chain ---- */

lm_status lm_check_radial_laws(const lm_radial_law *laws, int count, lm_fault *fault) {
  lm_status status = check_array(fault, "radial_chain", laws, count);
  int i = 0;
  for (i = 0; status == LM_OK && i < count; ++i) {
    const bound bounds[] = {
        {"radial_chain.coefficient_mm_per_Nn", laws[i].coefficient_mm_per_Nn, LM_REAL(0),
         LM_REAL(1)},
        {"radial_chain.exponent", laws[i].exponent, LM_REAL(0.25), LM_REAL(2)},
        {"radial_chain.share", laws[i].share, LM_REAL(-1), LM_REAL(1)},
        {"radial_chain.preload_N", laws[i].preload_N, LM_REAL(0), PRELOAD_MAX_N},
    };
    status = check_bounds(fault, bounds, COUNT_OF(bounds));
  }
  return status;
}

/* Hand the finished law out only if it is one that lm_sum_radial takes. */
static lm_status put_law(lm_real coefficient, lm_real exponent, lm_real share, lm_real preload,
                         lm_radial_law *law, lm_fault *fault) {
  lm_status status = LM_OK;
  lm_radial_law made;
  made.coefficient_mm_per_Nn = coefficient;
  made.exponent = exponent;
  made.share = share;
  made.preload_N = preload;
  if (law == 0) {
    return refuse(fault, LM_NULL, "law");
  }
  status = lm_check_radial_laws(&made, 1, fault);
  if (status == LM_OK) {
    *law = made;
  }
  return status;
}

lm_status lm_ball_hertz_coefficient(lm_real conformity, lm_real *coefficient, lm_fault *fault) {
  /* Hertz point contact of a steel ball in two grooves, per groove conformity. */
  static const double groove[] = {0.515, 0.52, 0.53, 0.54};
  static const double approach[] = {4.24e-4, 4.53e-4, 4.97e-4, 5.29e-4};
  const bound bounds[] = {{"conformity", conformity, LM_REAL(0.515), LM_REAL(0.54)}};
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  int i = 0;
  lm_real width = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (coefficient == 0) {
    return refuse(fault, LM_NULL, "coefficient");
  }
  while (i < COUNT_OF(groove) - 2 && conformity > LM_REAL(groove[i + 1])) {
    ++i;
  }
  width = (conformity - LM_REAL(groove[i])) / LM_REAL(groove[i + 1] - groove[i]);
  *coefficient = LM_REAL(approach[i]) + width * LM_REAL(approach[i + 1] - approach[i]);
  return LM_OK;
}

lm_status lm_make_ball_law(lm_real ball_diameter_mm, lm_real contact_angle_rad, lm_real coefficient,
                           lm_real share, lm_real preload_N, lm_radial_law *law, lm_fault *fault) {
  const lm_real exponent = LM_REAL(2) / LM_REAL(3);
  const bound bounds[] = {
      {"ball_diameter_mm", ball_diameter_mm, LM_REAL(0.1), LM_REAL(200)},
      {"contact_angle_rad", contact_angle_rad, LM_REAL(0), CONTACT_ANGLE_MAX},
      {"coefficient", coefficient, LM_REAL(1e-4), LM_REAL(1e-3)},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  return put_law(coefficient * real_pow(ball_diameter_mm, LM_REAL(-1) / LM_REAL(3)) /
                     real_cos(contact_angle_rad),
                 exponent, share, preload_N, law, fault);
}

/* c = factor l^power for rollers of both kinds. */
static lm_status make_roller(lm_real length, lm_real factor, lm_real power, lm_real exponent,
                             lm_real share, lm_real preload, lm_radial_law *law, lm_fault *fault) {
  const bound bounds[] = {{"roller_length_mm", length, LM_REAL(0.1), LM_REAL(500)}};
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  return put_law(factor * real_pow(length, power), exponent, share, preload, law, fault);
}

lm_status lm_make_roller_law(lm_real roller_length_mm, lm_real share, lm_real preload_N,
                             lm_radial_law *law, lm_fault *fault) {
  return make_roller(roller_length_mm, LM_REAL(7.68e-5), LM_REAL(-0.8), LM_REAL(0.9), share,
                     preload_N, law, fault);
}

lm_status lm_make_crowned_roller_law(lm_real roller_length_mm, lm_real share, lm_real preload_N,
                                     lm_radial_law *law, lm_fault *fault) {
  return make_roller(roller_length_mm, LM_REAL(1.81e-4), LM_REAL(-0.5), LM_REAL(0.75), share,
                     preload_N, law, fault);
}

lm_status lm_make_spring_law(lm_real stiffness_N_per_mm, lm_real share, lm_radial_law *law,
                             lm_fault *fault) {
  const bound bounds[] = {{"stiffness_N_per_mm", stiffness_N_per_mm, STIFFNESS_MIN, STIFFNESS_MAX}};
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  return put_law(LM_REAL(1) / stiffness_N_per_mm, LM_REAL(1), share, LM_REAL(0), law, fault);
}

lm_status lm_make_shaft_bending_law(lm_real diameter_mm, lm_real a_mm, lm_real b_mm,
                                    lm_real youngs_modulus_MPa, lm_radial_law *law,
                                    lm_fault *fault) {
  const bound bounds[] = {
      {"diameter_mm", diameter_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"a_mm", a_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"b_mm", b_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"youngs_modulus_MPa", youngs_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real d2 = LM_REAL(0);
  lm_real inertia = LM_REAL(0);
  lm_real product = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  d2 = diameter_mm * diameter_mm;
  inertia = LM_PI * d2 * d2 / LM_REAL(64);
  product = a_mm * b_mm;
  return put_law(product * product / (LM_REAL(3) * youngs_modulus_MPa * inertia * (a_mm + b_mm)),
                 LM_REAL(1), LM_REAL(1), LM_REAL(0), law, fault);
}

lm_status lm_make_rim_widening_law(lm_real inner_radius_mm, lm_real outer_radius_mm,
                                   lm_real width_mm, lm_real youngs_modulus_MPa,
                                   lm_real poisson_ratio, lm_radial_law *law, lm_fault *fault) {
  const bound bounds[] = {
      {"inner_radius_mm", inner_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"outer_radius_mm", outer_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"width_mm", width_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"youngs_modulus_MPa", youngs_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
      {"poisson_ratio", poisson_ratio, LM_REAL(0), POISSON_MAX},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real sum = LM_REAL(0);
  lm_real difference = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (!(inner_radius_mm < outer_radius_mm)) {
    return refuse(fault, LM_INCONSISTENT, "outer_radius_mm");
  }
  sum = inner_radius_mm * inner_radius_mm + outer_radius_mm * outer_radius_mm;
  difference = (outer_radius_mm - inner_radius_mm) * (outer_radius_mm + inner_radius_mm);
  /* p r_i = F / (pi b): the inner radius cancels outside the bracket. */
  return put_law((sum / difference + poisson_ratio) / (LM_PI * width_mm * youngs_modulus_MPa),
                 LM_REAL(1), LM_REAL(1), LM_REAL(0), law, fault);
}

lm_status lm_ovalisation_factor(lm_real patch_half_angle_rad, lm_real *factor, lm_fault *fault) {
  const bound bounds[] = {
      {"patch_half_angle_rad", patch_half_angle_rad, LM_REAL(0), CONTACT_ANGLE_MAX}};
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  const lm_real step = LM_REAL(2) * real_cos(LM_REAL(2) * patch_half_angle_rad);
  /* s_n = sin(n p) / sin p by s_(n+2) = 2 cos(2p) s_n - s_(n-2): no division by sin p, so a point
   * load needs no case of its own. */
  lm_real before = LM_REAL(0);
  lm_real here = LM_REAL(2) * real_cos(patch_half_angle_rad);
  lm_real sum = LM_REAL(0);
  int n = 0;
  if (status != LM_OK) {
    return status;
  }
  if (factor == 0) {
    return refuse(fault, LM_NULL, "factor");
  }
  for (n = 2; n <= 128; n += 2) {
    const lm_real order = (lm_real)n;
    const lm_real bending = order * order - LM_REAL(1);
    const lm_real next = step * here - before;
    sum += here / (order * bending * bending);
    before = here;
    here = next;
  }
  *factor = LM_REAL(2) / LM_PI * sum;
  return LM_OK;
}

lm_status lm_make_rim_ovalisation_law(lm_real mean_radius_mm, lm_real thickness_mm,
                                      lm_real width_mm, lm_real patch_half_angle_rad,
                                      lm_real youngs_modulus_MPa, lm_real housing_factor,
                                      lm_radial_law *law, lm_fault *fault) {
  const bound bounds[] = {
      {"mean_radius_mm", mean_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"thickness_mm", thickness_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"width_mm", width_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"youngs_modulus_MPa", youngs_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
      {"housing_factor", housing_factor, LM_REAL(1), LM_REAL(20)},
  };
  lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real factor = LM_REAL(0);
  lm_real slenderness = LM_REAL(0);
  if (status == LM_OK) {
    status = lm_ovalisation_factor(patch_half_angle_rad, &factor, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  slenderness = mean_radius_mm / thickness_mm;
  return put_law(LM_REAL(12) * factor * slenderness * slenderness * slenderness /
                     (youngs_modulus_MPa * width_mm * housing_factor),
                 LM_REAL(1), LM_REAL(1), LM_REAL(0), law, fault);
}

lm_status lm_bearing_share(lm_bearing_kind kind, int elements, lm_real contact_angle_rad,
                           lm_real *share, lm_fault *fault) {
  /* Load zone of a bearing with rigid rings: Stribeck's 4.37 for point contact, 4.08 for line
   * contact, 5 with the usual clearance. */
  static const double most_loaded[] = {4.37, 5.0, 4.08};
  const bound bounds[] = {
      {"kind", (lm_real)(int)kind, LM_REAL(LM_BEARING_BALLS), LM_REAL(LM_BEARING_ROLLERS)},
      {"elements", (lm_real)elements, LM_REAL(5), LM_REAL(200)},
      {"contact_angle_rad", contact_angle_rad, LM_REAL(0), CONTACT_ANGLE_MAX},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real found = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (share == 0) {
    return refuse(fault, LM_NULL, "share");
  }
  found = LM_REAL(most_loaded[kind]) / ((lm_real)elements * real_cos(contact_angle_rad));
  *share = found < LM_REAL(1) ? found : LM_REAL(1);
  return LM_OK;
}

lm_status lm_cam_bearing_share(lm_real balls_in_lobe, lm_real *share, lm_fault *fault) {
  const bound bounds[] = {{"balls_in_lobe", balls_in_lobe, LM_REAL(5), LM_REAL(7)}};
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  if (share == 0) {
    return refuse(fault, LM_NULL, "share");
  }
  *share = LM_REAL(0.35) - LM_REAL(0.05) * (balls_in_lobe - LM_REAL(5));
  return LM_OK;
}

lm_status lm_lobe_radial_force(lm_real torque_Nm, lm_real radius_mm, lm_real flank_angle_rad,
                               lm_real friction_angle_rad, lm_real *force_N, lm_fault *fault) {
  const bound bounds[] = {
      {"torque_Nm", torque_Nm, -TORQUE_MAX_NM, TORQUE_MAX_NM},
      {"radius_mm", radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"flank_angle_rad", flank_angle_rad, LM_REAL(0), FLANK_ANGLE_MAX},
      {"friction_angle_rad", friction_angle_rad, -FLANK_ANGLE_MAX, FLANK_ANGLE_MAX},
      {"flank_angle_rad - friction_angle_rad", flank_angle_rad - friction_angle_rad, LM_REAL(0),
       FLANK_ANGLE_MAX},
      {"flank_angle_rad + friction_angle_rad", flank_angle_rad + friction_angle_rad, LM_REAL(0),
       FLANK_ANGLE_MAX},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  if (force_N == 0) {
    return refuse(fault, LM_NULL, "force_N");
  }
  *force_N = NMM_PER_NM * real_fabs(torque_Nm) / (LM_REAL(2) * radius_mm) *
             real_tan(flank_angle_rad - friction_angle_rad);
  return LM_OK;
}

/* Force-approach law with its derivative, finite slope down to zero force (see
 * LM_RADIAL_FORCE_FLOOR_N), constant beyond lift-off. */
static lm_real law_approach(const lm_radial_law *law, lm_real force, lm_real *slope) {
  const lm_real n = law->exponent;
  const lm_real floor_force = LM_REAL(LM_RADIAL_FORCE_FLOOR_N);
  lm_real approach = LM_REAL(0);
  *slope = LM_REAL(0);
  if (force >= floor_force) {
    approach = law->coefficient_mm_per_Nn * real_pow(force, n);
    *slope = n * approach / force;
  } else if (force > LM_REAL(0)) {
    const lm_real s = force / floor_force;
    const lm_real at_floor = law->coefficient_mm_per_Nn * real_pow(floor_force, n);
    const lm_real rise = LM_REAL(2) - n;
    const lm_real bend = LM_REAL(1) - n;
    approach = at_floor * s * (rise - bend * s);
    *slope = at_floor * (rise - LM_REAL(2) * bend * s) / floor_force;
  }
  return approach;
}

lm_status lm_sum_radial(lm_real lobe_force_N, const lm_radial_law *laws, int count,
                        lm_real *approach_mm, lm_real *slope_mm_per_N, lm_fault *fault) {
  lm_status status = check_range(fault, "lobe_force_N", lobe_force_N, -FORCE_MAX_N, FORCE_MAX_N);
  lm_real approach = LM_REAL(0);
  lm_real slope = LM_REAL(0);
  int i = 0;
  if (status == LM_OK) {
    status = lm_check_radial_laws(laws, count, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  if (approach_mm == 0 || slope_mm_per_N == 0) {
    return refuse(fault, LM_NULL, "approach_mm or slope_mm_per_N");
  }
  for (i = 0; i < count; ++i) {
    lm_real preload_slope = LM_REAL(0);
    lm_real load_slope = LM_REAL(0);
    const lm_real at_preload = law_approach(&laws[i], laws[i].preload_N, &preload_slope);
    const lm_real at_load =
        law_approach(&laws[i], laws[i].preload_N + laws[i].share * lobe_force_N, &load_slope);
    approach += at_load - at_preload;
    slope += laws[i].share * load_slope;
  }
  *approach_mm = approach;
  *slope_mm_per_N = slope;
  return LM_OK;
}

lm_status lm_radial_to_tangential(lm_real radial_mm, lm_real flank_angle_rad,
                                  lm_real *tangential_mm, lm_fault *fault) {
  const bound bounds[] = {
      {"radial_mm", radial_mm, -DISPLACEMENT_MAX_MM, DISPLACEMENT_MAX_MM},
      {"flank_angle_rad", flank_angle_rad, LM_REAL(0), FLANK_ANGLE_MAX},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  if (tangential_mm == 0) {
    return refuse(fault, LM_NULL, "tangential_mm");
  }
  *tangential_mm = radial_mm * real_tan(flank_angle_rad);
  return LM_OK;
}

lm_status lm_radial_compliance_angle(lm_real radial_mm, lm_real flank_angle_rad, lm_real radius_mm,
                                     lm_real *angle_rad, lm_fault *fault) {
  lm_real tangential = LM_REAL(0);
  lm_status status = check_range(fault, "radius_mm", radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM);
  if (status == LM_OK) {
    status = lm_radial_to_tangential(radial_mm, flank_angle_rad, &tangential, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  if (angle_rad == 0) {
    return refuse(fault, LM_NULL, "angle_rad");
  }
  *angle_rad = tangential / radius_mm;
  return LM_OK;
}

/* ---- Torsion chain ---- */

lm_status lm_check_torsion_elements(const lm_torsion_element *elements, int count,
                                    lm_fault *fault) {
  lm_status status = check_array(fault, "torsion_chain", elements, count);
  int i = 0;
  for (i = 0; status == LM_OK && i < count; ++i) {
    const bound bounds[] = {
        {"torsion_chain.stiffness_Nm_per_rad", elements[i].stiffness_Nm_per_rad, STIFFNESS_MIN,
         STIFFNESS_MAX},
        {"torsion_chain.ratio", real_fabs(elements[i].ratio), RATIO_MIN, RATIO_MAX},
    };
    status = check_bounds(fault, bounds, COUNT_OF(bounds));
  }
  return status;
}

static lm_status put_element(lm_real stiffness_Nm_per_rad, lm_real ratio,
                             lm_torsion_element *element, lm_fault *fault) {
  lm_status status = LM_OK;
  lm_torsion_element made;
  made.stiffness_Nm_per_rad = stiffness_Nm_per_rad;
  made.ratio = ratio;
  if (element == 0) {
    return refuse(fault, LM_NULL, "element");
  }
  status = lm_check_torsion_elements(&made, 1, fault);
  if (status == LM_OK) {
    *element = made;
  }
  return status;
}

lm_status lm_make_shaft_torsion(lm_real outer_diameter_mm, lm_real bore_mm, lm_real length_mm,
                                lm_real shear_modulus_MPa, lm_real ratio,
                                lm_torsion_element *element, lm_fault *fault) {
  const bound bounds[] = {
      {"outer_diameter_mm", outer_diameter_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"bore_mm", bore_mm, LM_REAL(0), LENGTH_MAX_MM},
      {"length_mm", length_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"shear_modulus_MPa", shear_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real inertia = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (!(bore_mm < outer_diameter_mm)) {
    return refuse(fault, LM_INCONSISTENT, "bore_mm");
  }
  /* D^4 - d^4 factored, so that a thin tube keeps its digits. */
  inertia = LM_PI / LM_REAL(32) * (outer_diameter_mm - bore_mm) * (outer_diameter_mm + bore_mm) *
            (outer_diameter_mm * outer_diameter_mm + bore_mm * bore_mm);
  return put_element(shear_modulus_MPa * inertia / (length_mm * NMM_PER_NM), ratio, element, fault);
}

lm_status lm_make_shell_torsion(lm_real mean_radius_mm, lm_real wall_mm, lm_real length_mm,
                                lm_real shear_modulus_MPa, lm_torsion_element *element,
                                lm_fault *fault) {
  const bound bounds[] = {
      {"mean_radius_mm", mean_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"wall_mm", wall_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"length_mm", length_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"shear_modulus_MPa", shear_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real inertia = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (!(wall_mm < LM_REAL(2) * mean_radius_mm)) {
    return refuse(fault, LM_INCONSISTENT, "wall_mm");
  }
  /* pi/2 (r_o^4 - r_i^4) with r_o,i = r +- s/2. */
  inertia = LM_REAL(2) * LM_PI * mean_radius_mm * wall_mm *
            (mean_radius_mm * mean_radius_mm + wall_mm * wall_mm / LM_REAL(4));
  return put_element(shear_modulus_MPa * inertia / (length_mm * NMM_PER_NM), LM_REAL(1), element,
                     fault);
}

lm_status lm_make_diaphragm_torsion(lm_real hub_radius_mm, lm_real outer_radius_mm,
                                    lm_real thickness_mm, lm_real shear_modulus_MPa,
                                    lm_torsion_element *element, lm_fault *fault) {
  const bound bounds[] = {
      {"hub_radius_mm", hub_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"outer_radius_mm", outer_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"thickness_mm", thickness_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"shear_modulus_MPa", shear_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real ratio = LM_REAL(0);
  lm_real twist = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (!(hub_radius_mm < outer_radius_mm)) {
    return refuse(fault, LM_INCONSISTENT, "hub_radius_mm");
  }
  /* a^-2 - r^-2 = (1 - q) (1 + q) / a^2 with q = a / r. Shear stress T / (2 pi rho^2 h): its twist
   * d(v / rho) = tau / (G rho) d rho integrates to T (a^-2 - r^-2) / (4 pi G h). */
  ratio = hub_radius_mm / outer_radius_mm;
  twist = (outer_radius_mm - hub_radius_mm) / outer_radius_mm * (LM_REAL(1) + ratio);
  return put_element(LM_REAL(4) * LM_PI * shear_modulus_MPa * thickness_mm * hub_radius_mm *
                         hub_radius_mm / (twist * NMM_PER_NM),
                     LM_REAL(1), element, fault);
}

lm_status lm_make_input_lock(lm_real stiffness_Nm_per_rad, lm_real ratio,
                             lm_torsion_element *element, lm_fault *fault) {
  return put_element(stiffness_Nm_per_rad, ratio, element, fault);
}

lm_status lm_sum_torsion(lm_real torque_Nm, const lm_torsion_element *elements, int count,
                         lm_real *angle_rad, lm_real *compliance_rad_per_Nm, lm_fault *fault) {
  lm_status status = check_range(fault, "torque_Nm", torque_Nm, -TORQUE_MAX_NM, TORQUE_MAX_NM);
  lm_real compliance = LM_REAL(0);
  int i = 0;
  if (status == LM_OK) {
    status = lm_check_torsion_elements(elements, count, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  if (angle_rad == 0 || compliance_rad_per_Nm == 0) {
    return refuse(fault, LM_NULL, "angle_rad or compliance_rad_per_Nm");
  }
  for (i = 0; i < count; ++i) {
    compliance +=
        LM_REAL(1) / (elements[i].stiffness_Nm_per_rad * elements[i].ratio * elements[i].ratio);
  }
  *angle_rad = torque_Nm * compliance;
  *compliance_rad_per_Nm = compliance;
  return LM_OK;
}

/* ---- Teeth ---- */

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

/* What every tooth function takes: face width, load angle, elastic constants. */
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

/* Strip of a tooth whose thickness runs straight from one height to the next. */
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
    /* The strip that holds the load ends there. The load lies within the samples, so the loop ends
     * before the last one is passed. */
    const lm_real end = height_mm[i + 1] < load_height_mm ? height_mm[i + 1] : load_height_mm;
    const lm_real along = (end - height_mm[i]) / (height_mm[i + 1] - height_mm[i]);
    const lm_real below = LM_REAL(2) * half_thickness_mm[i];
    const lm_real above = LM_REAL(2) * half_thickness_mm[i + 1];
    add_trapezoid(&sums, height_mm[i], end, below, below + along * (above - below), load_height_mm);
  }
  put_tooth(&sums, face_width_mm, load_angle_rad, material, compliance);
  return LM_OK;
}

/* Pressure angle and involute function at a radius; both zero below the base circle, where the
 * flank goes on radially. atan of the tangent keeps its digits where acos of a number near one
 * loses them. */
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

/* From the base circle (or the end of the tooth next to it) to a radius on either side. Radius =
 * joint
 * + length t^2 (3 - 2t) crowds the points at both ends: at the base circle, where the involute
 * function starts with the power 3/2, and at a thin tip. Two Gauss panels in t. dy counts positive
 * whichever way the tooth points. */
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

/* Into low .. high, whichever of the two ends is the larger. */
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
  /* The flank has a joint at the base circle. Where that lies outside the tooth, one span is
   * empty. */
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

/* ---- Radial gap ---- */

lm_status lm_radial_gap_sum(lm_real generator_gap_mm, lm_real teeth_gap_mm, lm_real *gap_mm,
                            lm_fault *fault) {
  const bound bounds[] = {
      {"generator_gap_mm", generator_gap_mm, LM_REAL(0), DISPLACEMENT_MAX_MM},
      {"teeth_gap_mm", teeth_gap_mm, LM_REAL(0), DISPLACEMENT_MAX_MM},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  if (gap_mm == 0) {
    return refuse(fault, LM_NULL, "gap_mm");
  }
  *gap_mm = generator_gap_mm + teeth_gap_mm;
  return LM_OK;
}

lm_status lm_radial_gap_angle(lm_real gap_mm, lm_real flank_angle_rad, lm_real radius_mm,
                              lm_real *angle_rad, lm_fault *fault) {
  const bound bounds[] = {
      {"gap_mm", gap_mm, LM_REAL(0), DISPLACEMENT_MAX_MM},
      {"flank_angle_rad", flank_angle_rad, LM_REAL(0), FLANK_ANGLE_MAX},
      {"radius_mm", radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  if (angle_rad == 0) {
    return refuse(fault, LM_NULL, "angle_rad");
  }
  *angle_rad = gap_mm * real_tan(flank_angle_rad) / radius_mm;
  return LM_OK;
}

lm_status lm_ring_stiffness(lm_real mean_radius_mm, lm_real thickness_mm, lm_real width_mm,
                            lm_real youngs_modulus_MPa, lm_real stiffening,
                            lm_real *stiffness_N_per_mm, lm_fault *fault) {
  const bound bounds[] = {
      {"mean_radius_mm", mean_radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"thickness_mm", thickness_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"width_mm", width_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"youngs_modulus_MPa", youngs_modulus_MPa, LM_REAL(1), MODULUS_MAX_MPA},
      {"stiffening", stiffening, LM_REAL(1), LM_REAL(20)},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  lm_real slimness = LM_REAL(0);
  if (status != LM_OK) {
    return status;
  }
  if (stiffness_N_per_mm == 0) {
    return refuse(fault, LM_NULL, "stiffness_N_per_mm");
  }
  slimness = thickness_mm / mean_radius_mm;
  *stiffness_N_per_mm = stiffening * youngs_modulus_MPa * width_mm * slimness * slimness *
                        slimness / (LM_REAL(12) * RING_POINT_LOAD);
  return LM_OK;
}

lm_status lm_gap_closing_torque(lm_real gap_mm, lm_real radius_mm, lm_real ring_stiffness_N_per_mm,
                                lm_real flank_angle_rad, lm_real *torque_Nm, lm_fault *fault) {
  const bound bounds[] = {
      {"gap_mm", gap_mm, LM_REAL(0), DISPLACEMENT_MAX_MM},
      {"radius_mm", radius_mm, LENGTH_MIN_MM, LENGTH_MAX_MM},
      {"ring_stiffness_N_per_mm", ring_stiffness_N_per_mm, STIFFNESS_MIN, STIFFNESS_MAX},
      {"flank_angle_rad", flank_angle_rad, FLANK_ANGLE_MIN, FLANK_ANGLE_MAX},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status != LM_OK) {
    return status;
  }
  if (torque_Nm == 0) {
    return refuse(fault, LM_NULL, "torque_Nm");
  }
  *torque_Nm = LM_REAL(2) * radius_mm * ring_stiffness_N_per_mm * gap_mm /
               (real_tan(flank_angle_rad) * NMM_PER_NM);
  return LM_OK;
}

/* Inputs of both forms of (9a). */
static lm_status check_gap_rotation(lm_real torque_Nm, lm_real closing_torque_Nm,
                                    lm_real full_angle_rad, const lm_real *angle_rad,
                                    lm_fault *fault) {
  const bound bounds[] = {
      {"torque_Nm", torque_Nm, -TORQUE_MAX_NM, TORQUE_MAX_NM},
      {"closing_torque_Nm", closing_torque_Nm, LM_REAL(0), TORQUE_MAX_NM},
      {"full_angle_rad", full_angle_rad, LM_REAL(0), LM_REAL(1)},
  };
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  if (status == LM_OK && angle_rad == 0) {
    return refuse(fault, LM_NULL, "angle_rad");
  }
  return status;
}

lm_status lm_gap_rotation(lm_real torque_Nm, lm_real closing_torque_Nm, lm_real full_angle_rad,
                          lm_real *angle_rad, lm_fault *fault) {
  const lm_status status =
      check_gap_rotation(torque_Nm, closing_torque_Nm, full_angle_rad, angle_rad, fault);
  if (status != LM_OK) {
    return status;
  }
  if (torque_Nm > closing_torque_Nm) {
    *angle_rad = full_angle_rad;
  } else if (torque_Nm < -closing_torque_Nm) {
    *angle_rad = -full_angle_rad;
  } else if (closing_torque_Nm > LM_REAL(0)) {
    *angle_rad = torque_Nm / closing_torque_Nm * full_angle_rad;
  } else {
    *angle_rad = LM_REAL(0);
  }
  return LM_OK;
}

lm_status lm_gap_rotation_smooth(lm_real torque_Nm, lm_real closing_torque_Nm,
                                 lm_real full_angle_rad, lm_real *angle_rad, lm_fault *fault) {
  /* tanh(20) is 1 to double precision: beyond it the quotient is not formed. */
  const lm_real saturation = LM_REAL(20);
  const lm_status status =
      check_gap_rotation(torque_Nm, closing_torque_Nm, full_angle_rad, angle_rad, fault);
  if (status != LM_OK) {
    return status;
  }
  if (torque_Nm > saturation * closing_torque_Nm) {
    *angle_rad = full_angle_rad;
  } else if (torque_Nm < -saturation * closing_torque_Nm) {
    *angle_rad = -full_angle_rad;
  } else if (closing_torque_Nm > LM_REAL(0)) {
    /* tanh |x| = (1 - e^-2|x|) / (1 + e^-2|x|): odd to the last bit, no overflow. */
    const lm_real decay = real_exp(LM_REAL(-2) * real_fabs(torque_Nm) / closing_torque_Nm);
    const lm_real rise = full_angle_rad * ((LM_REAL(1) - decay) / (LM_REAL(1) + decay));
    *angle_rad = torque_Nm < LM_REAL(0) ? -rise : rise;
  } else {
    *angle_rad = LM_REAL(0);
  }
  return LM_OK;
}
