#include "lostmotion/radial_chain.h"

#include "elastic_ranges.h"
#include "real_math.h"
#include "refuse.h"

#define CONTACT_ANGLE_MAX LM_REAL(1.2)
#define PRELOAD_MAX_N LM_REAL(1e6)

lm_status lm_check_radial_laws(const lm_radial_law *laws, int count, lm_fault *fault) {
  lm_status status = check_chain(fault, "radial_chain", laws, count);
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

/* Return the finished law only if lm_sum_radial accepts it. */
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
    return refuse_contradiction(fault, "outer_radius_mm", outer_radius_mm, inner_radius_mm,
                                LENGTH_MAX_MM);
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
