/* All parameters of one drive for the controller, in one constant struct.
 *
 * `lostmotion export` writes it as a C header (a `static const lm_parameters` in flash) or as a
 * binary blob that lm_load_parameters converts to the same struct. lm_check_parameters accepts it
 * once or refuses it with a reason; afterwards it is not checked again.
 *
 * Binary form, little-endian, every number IEEE 754 binary32 or uint32:
 *
 *     "LMP1"                     4 bytes
 *     endianness mark            0x01020304
 *     format                     LM_PARAMETERS_FORMAT
 *     length                     total number of bytes
 *     torque limit
 *     curve      count, then torque and angle of each knot
 *     operators      count, outside count, then radius, widening, weight of each; envelope, knee
 *     effects    count, then of each: id, number of values, values
 *     limits     the six of lm_limits
 *     watch      the six of lm_watch
 *     validity   the seven numbers of lm_validity
 *     CRC-32     of all bytes before it (IEEE 802.3, as zlib computes it)
 */
#ifndef LOSTMOTION_PARAMETERS_H
#define LOSTMOTION_PARAMETERS_H

#include <stddef.h>
#include <stdint.h>

#include "lostmotion/curve.h"
#include "lostmotion/effects.h"
#include "lostmotion/play.h"
#include "lostmotion/profile.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"
#include "lostmotion/symbols.h"

LM_BEGIN_DECLS

#define LM_PARAMETERS_FORMAT 3u /* of the binary form and, with the sizes, of the struct */

/* Format and sizes of profile.h that the struct was compiled with, so that a library of other sizes
 * or of the other precision refuses it (the check at link time, symbols.h, does not cover a
 * constant in flash). */
#define LM_PARAMETERS_LAYOUT                                                                \
  (LM_PARAMETERS_FORMAT + LM_REAL_BITS / 64 * 8UL +                                         \
   16UL * ((((LM_EFFECT_MEMORY_MAX * 65UL + LM_EFFECTS_MAX) * 33UL + LM_PLAYS_MAX) * 65UL + \
            LM_CURVE_POINTS_MAX) *                                                          \
               4UL +                                                                        \
           LM_PROFILE))

/* Limits of the correction; see compensator.h. All greater than zero. */
typedef struct lm_limits {
  lm_real period_s;       /* between two calls of lm_step_compensator, at most 1 */
  lm_real correction_rad; /* largest correction, at most 1 */
  lm_real velocity_rad_s; /* of the correction, on the output */
  lm_real acceleration_rad_s2;
  lm_real jerk_rad_s3;
  lm_real response_per_s; /* rate at which the correction approaches its target, at most 1 / (16
                             period) */
} lm_limits;

/* Criteria for fading the correction out and for ringing; see lm_watch_output and compensator.h. */
typedef struct lm_watch {
  lm_real window_s;    /* time over which errors are averaged, > 0 */
  lm_real fade_s;      /* time to fade fully out or in, > 0 */
  lm_real noise_rad;   /* rms of the measurement noise, >= 0 */
  lm_real misfit_rad;  /* rms of the residual above which a misfit is reported, >= noise_rad */
  lm_real creep_rad_s; /* largest speed at which a fade moves an axis at rest, >= 0; 0: no limit but
                          fade_s */
  lm_real
      ringing_Hz; /* a self-sustained oscillation of the correction above this frequency is ringing:
                     a fifth of the joint's lowest resonance, for example; 0: no detection */
} lm_watch;

/* Validity of the parameters: the fitted ranges. Both ends 0: not stated, no limit. */
typedef struct lm_validity {
  lm_real torque_Nm; /* either sign, >= 0. From here to the torque limit the curve is extrapolated;
                        LM_STATE_EXTRAPOLATED */
  lm_real temperature_C[2]; /* lower and upper end. Conditions outside are clipped to the range;
                               LM_STATE_EXTRAPOLATED */
  lm_real cycles[2];
  lm_real input_velocity_rad_s[2];
} lm_validity;

/* One active effect and its values in the order of its card. */
typedef struct lm_effect_use {
  const lm_effect *effect;
  lm_real value[LM_EFFECT_VALUES_MAX];
} lm_effect_use;

typedef struct lm_parameters {
  uint32_t format;         /* LM_PARAMETERS_LAYOUT */
  uint32_t fingerprint;    /* CRC-32 of the binary form; identifies the set of parameters */
  lm_real torque_limit_Nm; /* torque above it, either sign, is clipped; 0 < limit <= 1e6.
                            * Gap profile: the largest commanded angle, rad */
  lm_limits limits;
  lm_watch watch;
  lm_validity valid;
  lm_play_bank plays;
#if LM_PROFILE != LM_PROFILE_GAP
  lm_curve curve;
#endif
#if LM_EFFECTS_MAX > 0
  int32_t effect_count;
  lm_effect_use effect[LM_EFFECTS_MAX]; /* in the order of their kinds */
#endif
} lm_parameters;

#define LM_TORQUE_LIMIT_MAX_NM LM_REAL(1e6)

/* Size of the largest binary form, bytes. */
#define LM_BLOB_BYTES_MAX                                                 \
  (16 + 4 + 4 + 8 * LM_CURVE_POINTS_MAX + 8 + 12 * LM_PLAYS_MAX + 8 + 4 + \
   (8 + 4 * LM_EFFECT_VALUES_MAX) * LM_EFFECTS_MAX + 24 + 24 + 28 + 4)

/* Checks parameters: format, every range above (of lm_validity: within +-1e12, upper end not below
 * the lower), the curve (lm_check_curve), the operators against the least slope of the curve
 * (lm_check_play_bank), and the effects: each one (lm_check_effect), the order of kinds, total
 * memory at most LM_EFFECT_MEMORY_MAX. Errors: LM_NULL; LM_CORRUPT ("format": another format, or
 * the program was compiled with other sizes of profile.h than the library); those of the checks
 * named. */
lm_status lm_check_parameters(const lm_parameters *parameters, lm_fault *fault);

/* Reads the binary form. table[table_count]: the effects that may occur (lm_effects for all effects
 * of the library; may be null if table_count is 0). Safe for arbitrary bytes. Errors: LM_NULL;
 * LM_CORRUPT with the fault "magic", "endianness", "format", "length", "crc" or "effect" (an id
 * that is not in the table); LM_TOO_SMALL with the size of profile.h that is less than the fault's
 * `found` ("LM_EFFECTS_MAX", for example: build with a larger one), or "outside_count"; those of
 * lm_check_parameters. On an error found after the CRC check the struct has been written and is
 * marked unusable (format 0). The struct is filled in place to keep the stack small: never load
 * into the struct that an instance uses, but into another one, and pass that to
 * lm_change_parameters. */
lm_status lm_load_parameters(lm_parameters *parameters, const uint8_t *bytes, size_t length,
                             const lm_effect *const *table, int32_t table_count, lm_fault *fault)
    LM_SIZED(lm_load_parameters);

/* Writes the binary form of checked parameters into bytes[capacity] and its length into *length.
 * The fingerprint of the loaded parameters is the CRC in its last four bytes.
 * Errors: LM_NULL, LM_TOO_SMALL ("capacity"; the fault states the length needed). */
lm_status lm_store_parameters(const lm_parameters *parameters, uint8_t *bytes, size_t capacity,
                              size_t *length, lm_fault *fault);

/* CRC-32 (IEEE 802.3) of bytes; `before` is 0, or the CRC of the preceding bytes. */
uint32_t lm_find_crc(uint32_t before, const void *bytes, size_t length);

LM_END_DECLS

#endif
