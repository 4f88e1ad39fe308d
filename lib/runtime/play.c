#include "lostmotion/play.h"

#include "runtime/number.h"
#include "runtime/plain_symbol.h"
#include "runtime/play_kernel.h"

static lm_status check_counts(int32_t count, int32_t outside_count, lm_fault *fault) {
  if (count < 0 || count > LM_PLAYS_MAX) {
    return lm_refuse(fault, LM_OUT_OF_RANGE, "count", LM_REAL(count), 0, LM_REAL(LM_PLAYS_MAX));
  }
  if (outside_count < 0 || outside_count > count) {
    return lm_refuse(fault, LM_OUT_OF_RANGE, "outside_count", LM_REAL(outside_count), 0,
                     LM_REAL(count));
  }
  return LM_OK;
}

static lm_status check_play(lm_real radius_Nm, lm_real widening, lm_real weight, lm_fault *fault) {
  lm_status status = lm_check_range(fault, "radius_Nm", radius_Nm, 0, LM_PLAY_RADIUS_MAX_NM);
  if (status == LM_OK) {
    status = lm_check_range(fault, "widening", widening, 0, LM_PLAY_WIDENING_MAX);
  }
  if (status == LM_OK) {
    status = lm_check_range(fault, "weight", weight, 0, LM_PLAY_WEIGHT_MAX);
  }
  return status;
}

/* The widening as the slope of the steep edge can represent it: because it is rounded there first,
 * a bank that is written and read back is bit-identical. */
static lm_real held_widening(lm_real widening) {
  lm_real steep = 1 + widening;
  return steep - 1;
}

static lm_real sum_weights(const lm_play_slot *slot, int32_t from, int32_t to) {
  lm_real sum = 0;
  int32_t i;
  for (i = from; i < to; ++i) {
    sum += slot[i].weight;
  }
  return sum;
}

lm_status lm_build_play_bank(lm_play_bank *bank, const lm_play *play, int32_t count,
                             int32_t outside_count, lm_fault *fault) {
  lm_status status;
  int32_t i;
  if (!bank || (!play && count != 0)) {
    return lm_refuse(fault, LM_NULL, "bank", 0, 0, 0);
  }
  status = check_counts(count, outside_count, fault);
  for (i = 0; status == LM_OK && i < count; ++i) {
    status = check_play(play[i].radius_Nm, play[i].widening, play[i].weight, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  bank->count = count;
  bank->outside_count = outside_count;
  bank->widens = 0;
  bank->envelope_Nm = 0;
  bank->knee_Nm = 1;
  for (i = 0; i < LM_PLAYS_MAX; ++i) {
    lm_play_slot *slot = &bank->slot[i];
    lm_real widening = (i < count) ? held_widening(play[i].widening) : 0;
    slot->radius_Nm = (i < count) ? play[i].radius_Nm : 0;
    slot->edge_slope[0] = 1 - widening;
    slot->edge_slope[1] = 1 + widening;
    bank->widens |= widening > 0;
    slot->weight = (i < count) ? play[i].weight : 0;
  }
  bank->outside_rad_per_Nm = sum_weights(bank->slot, 0, outside_count);
  bank->inside_share = sum_weights(bank->slot, outside_count, count);
  return LM_OK;
}
PLAIN_SYMBOL(lm_build_play_bank, LM_SIZES_TEXT)

static lm_status check_envelope(lm_real envelope_Nm, lm_real knee_Nm, lm_fault *fault) {
  const lm_real most_Nm = LM_ENVELOPE ? LM_PLAY_RADIUS_MAX_NM : 0;
  lm_status status = lm_check_range(fault, "envelope_Nm", envelope_Nm, 0, most_Nm);
  if (status == LM_OK) {
    status = lm_check_range(fault, "knee_Nm", knee_Nm, LM_PLAY_KNEE_MIN_NM, LM_PLAY_RADIUS_MAX_NM);
  }
  return status;
}

lm_status lm_set_envelope(lm_play_bank *bank, lm_real envelope_Nm, lm_real knee_Nm,
                          lm_fault *fault) {
  lm_status status;
  if (!bank) {
    return lm_refuse(fault, LM_NULL, "bank", 0, 0, 0);
  }
  status = check_envelope(envelope_Nm, knee_Nm, fault);
  if (status == LM_OK) {
    bank->envelope_Nm = envelope_Nm;
    bank->knee_Nm = knee_Nm;
  }
  return status;
}

lm_real lm_find_envelope(const lm_play_bank *bank, lm_real torque_Nm) {
  return envelope_at(bank, torque_Nm);
}

/* True if a cached number equals its source value, possibly in another precision. */
static int agrees(lm_real cached, lm_real expected) {
  return absolute(cached - expected) <= LM_PLAY_SUM_TOLERANCE * expected;
}

/* Name of a cached or unused field that differs from lm_build_play_bank; null if none. */
static const char *find_inconsistent(const lm_play_bank *bank, lm_real least_slope_rad_per_Nm) {
  lm_real rise = 1 + bank->envelope_Nm / bank->knee_Nm;
  lm_real outside_rad_per_Nm = sum_weights(bank->slot, 0, bank->outside_count);
  lm_real inside = sum_weights(bank->slot, bank->outside_count, bank->count);
  int32_t i;
  for (i = 0; i < LM_PLAYS_MAX; ++i) {
    const lm_play_slot *slot = &bank->slot[i];
    lm_real widening = slot->edge_slope[1] - 1;
    if (!bank->widens && widening != 0) {
      return "widens";
    }
    if (!(absolute(slot->edge_slope[0] - (1 - widening)) <= LM_PLAY_SUM_TOLERANCE)) {
      return "edge_slope";
    }
    if (i >= bank->count && (slot->radius_Nm != 0 || widening != 0 || slot->weight != 0)) {
      return "padding";
    }
  }
  if (!agrees(bank->inside_share, inside) || rise * inside > 1 + LM_PLAY_SUM_TOLERANCE) {
    return "inside_share";
  }
  if (!agrees(bank->outside_rad_per_Nm, outside_rad_per_Nm) ||
      (outside_rad_per_Nm > 0 &&
       !((1 - rise * inside) * least_slope_rad_per_Nm >= rise * outside_rad_per_Nm))) {
    return "outside_rad_per_Nm";
  }
  return 0;
}

lm_status lm_check_play_bank(const lm_play_bank *bank, lm_real least_slope_rad_per_Nm,
                             lm_fault *fault) {
  lm_status status;
  const char *wrong;
  int32_t i;
  if (!bank) {
    return lm_refuse(fault, LM_NULL, "bank", 0, 0, 0);
  }
  status = check_counts(bank->count, bank->outside_count, fault);
  if (status != LM_OK) {
    return status;
  }
  for (i = 0; status == LM_OK && i < LM_PLAYS_MAX; ++i) {
    const lm_play_slot *slot = &bank->slot[i];
    status = check_play(slot->radius_Nm, slot->edge_slope[1] - 1, slot->weight, fault);
  }
  if (status == LM_OK) {
    status = check_envelope(bank->envelope_Nm, bank->knee_Nm, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  wrong = find_inconsistent(bank, least_slope_rad_per_Nm);
  if (wrong) {
    status = lm_refuse(fault, LM_INCONSISTENT, wrong, 0, 0, 0);
  }
  return status;
}

/* Half width of a band at the envelope. */
static lm_real radius_at(const lm_play_slot *slot, lm_real at_Nm) {
  return slot->radius_Nm + (slot->edge_slope[1] - 1) * absolute(at_Nm);
}

lm_real lm_find_play_radius(const lm_play_bank *bank, int32_t i, lm_real torque_Nm) {
  return radius_at(&bank->slot[i], envelope_at(bank, torque_Nm));
}

void lm_center_plays(lm_play_memory *memory, lm_real torque_Nm) {
  int32_t i;
  memory->torque_Nm = torque_Nm;
  for (i = 0; i < LM_PLAYS_MAX; ++i) {
    memory->z_Nm[i] = torque_Nm;
  }
}
PLAIN_SYMBOL(lm_center_plays, LM_SIZES_TEXT)

void lm_settle_plays(const lm_play_bank *bank, lm_play_memory *memory) {
  lm_real at_Nm = envelope_at(bank, memory->torque_Nm);
  int32_t i;
  for (i = 0; i < LM_PLAYS_MAX; ++i) {
    const lm_play_slot *slot = &bank->slot[i];
    memory->z_Nm[i] = clamp(memory->z_Nm[i], lower_edge(slot, at_Nm), upper_edge(slot, at_Nm));
  }
}

lm_play_sum lm_advance_plays(const lm_play_bank *bank, lm_play_memory *memory, lm_real torque_Nm) {
  return advance_plays(bank, memory, torque_Nm);
}

static lm_real push_scaled(const lm_play_slot *slot, lm_real *place_Nm, lm_real at_Nm,
                           lm_real width_scale) {
  lm_real radius_Nm = width_scale * radius_at(slot, at_Nm);
  *place_Nm = clamp(*place_Nm, at_Nm - radius_Nm, at_Nm + radius_Nm);
  return *place_Nm;
}

lm_play_sum lm_advance_scaled_plays(const lm_play_bank *bank, lm_play_memory *memory,
                                    lm_real torque_Nm, lm_real width_scale) {
  lm_real at_Nm = envelope_at(bank, torque_Nm);
  running_sum sum;
  int32_t i;
  start_sum(&sum, bank, push_scaled(&bank->slot[0], &memory->z_Nm[0], at_Nm, width_scale));
  for (i = 1; i < LM_PLAYS_MAX; ++i) {
    add_to_sum(&sum, bank, i, push_scaled(&bank->slot[i], &memory->z_Nm[i], at_Nm, width_scale));
  }
  memory->torque_Nm = torque_Nm;
  return split_sum(&sum, bank, at_Nm);
}

void lm_run_play_bank(const lm_play_bank *bank, lm_play_memory *memory, const lm_real *torque_Nm,
                      int64_t count, lm_real *outside_rad, lm_real *inside_Nm) {
  int64_t k;
  for (k = 0; k < count; ++k) {
    lm_play_sum sum = lm_advance_plays(bank, memory, torque_Nm[k]);
    if (outside_rad) {
      outside_rad[k] = sum.outside_rad;
    }
    if (inside_Nm) {
      inside_Nm[k] = sum.inside_Nm;
    }
  }
}

void lm_run_plays(const lm_real *radius_Nm, const lm_real *widening, int32_t operators,
                  lm_real *z_Nm, const lm_real *torque_Nm, const lm_real *width_scale,
                  int64_t count, lm_real *difference_Nm) {
  int64_t k;
  int32_t i;
  for (k = 0; k < count; ++k) {
    lm_real now_Nm = torque_Nm[k];
    lm_real side = now_Nm >= 0 ? LM_REAL(1) : LM_REAL(-1);
    lm_real *row = difference_Nm + k * operators;
    for (i = 0; i < operators; ++i) {
      lm_real widen = side * held_widening(widening[i]);
      lm_real low_Nm;
      lm_real high_Nm;
      if (width_scale) {
        lm_real half_Nm = width_scale[k] * (radius_Nm[i] + widen * now_Nm);
        low_Nm = now_Nm - half_Nm;
        high_Nm = now_Nm + half_Nm;
      } else {
        low_Nm = (1 - widen) * now_Nm - radius_Nm[i];
        high_Nm = (1 + widen) * now_Nm + radius_Nm[i];
      }
      z_Nm[i] = clamp(z_Nm[i], low_Nm, high_Nm);
      row[i] = z_Nm[i] - now_Nm;
    }
  }
}

void lm_find_followed(const lm_play_bank *bank, const lm_real *radius_Nm, const lm_real *widening,
                      const lm_real *share, int32_t operators, const lm_real *torque_Nm,
                      const lm_real *compliance, const lm_real *width_scale, int64_t count,
                      lm_real *difference_Nm, lm_real *followed_Nm) {
  lm_real inside_Nm = 0;
  lm_real before_Nm = 0;
  int64_t k;
  int32_t i;
  for (i = 0; i < operators; ++i) {
    inside_Nm += share[i] * difference_Nm[i];
  }
  for (k = 0; k < count; ++k) {
    lm_real to_Nm = softened_torque(bank, torque_Nm[k], inside_Nm, compliance[k]);
    lm_real now_Nm = envelope_at(bank, to_Nm);
    lm_real moved_Nm = k > 0 ? now_Nm - before_Nm : 0;
    inside_Nm = 0;
    for (i = 0; i < operators; ++i) {
      lm_real half_Nm = radius_Nm[i] + held_widening(widening[i]) * absolute(now_Nm);
      if (width_scale) {
        half_Nm *= width_scale[k];
      }
      difference_Nm[i] = clamp(difference_Nm[i] - moved_Nm, -half_Nm, half_Nm);
      inside_Nm += share[i] * difference_Nm[i];
    }
    followed_Nm[k] = now_Nm;
    before_Nm = now_Nm;
  }
}
