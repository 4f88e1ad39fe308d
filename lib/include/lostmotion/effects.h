/* Secondary effects: one interface for the effects of the library and of the user.
 *
 * An effect is a constant `lm_effect`: a function of its values, its memory and the present
 * conditions, with a description. The function returns one number:
 *
 *     LM_EFFECT_TORQUE      torque to add, N*m (sensor offset, scale)
 *     LM_EFFECT_COMPLIANCE  relative change of the compliance (stiffness over an angle, temperature)
 *     LM_EFFECT_WIDTH       factor on the width of the friction bands (grease, temperature)
 *     LM_EFFECT_ANGLE       lost motion to add, rad (everything else)
 *
 * Friction in the mesh follows the angle that the drive winds up by. A changed compliance therefore
 * moves it even at a constant torque, in proportion to the torque less the friction itself: the
 * operators follow the torque at which the drive winds up by as much without the change (model.h).
 *
 * The same compiled function runs over whole recordings on the desktop (lm_run_effect) and once a
 * tick on the controller. Effects that the parameters do not name are not linked.
 *
 * A user effect is another constant `lm_effect` in a user's file, named in the parameters (C
 * header) or in the table passed to lm_load_parameters (binary). Its function must return a finite
 * number for finite inputs, must not contain unbounded loops, and keeps its state in `memory`,
 * which starts at zero.
 *
 * The library's effects are listed in effect_list.h, one file each under lib/runtime/effects/.
 */
#ifndef LOSTMOTION_EFFECTS_H
#define LOSTMOTION_EFFECTS_H

#include <stdint.h>

#include "lostmotion/condition_list.h"
#include "lostmotion/effect_list.h"
#include "lostmotion/elementary.h"
#include "lostmotion/profile.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

#ifndef LM_EFFECT_CARDS
#define LM_EFFECT_CARDS \
  1 /* 0 or 1: link the descriptions of the effects (text); 0 on a controller */
#endif
#if LM_EFFECT_CARDS < 0 || LM_EFFECT_CARDS > 1
#error "lostmotion: LM_EFFECT_CARDS must be 0 or 1"
#endif

#define LM_EFFECT_VALUES_MAX 6 /* values of one effect */
#define LM_COUNT_EFFECT(name) +1
#define LM_EFFECT_COUNT (0 LM_EFFECT_LIST(LM_COUNT_EFFECT)) /* effects of the library */

/* Present conditions, as far as the host knows them: the fields of condition_list.h, in its order.
 * Unknown ones stay LM_UNKNOWN, as in LM_CONDITIONS_UNKNOWN. The model replaces them (temperature
 * by the reference temperature, torque by the previous torque, others by zero). It sets
 * LM_STATE_CONDITION_MISSING for the torque, and for others if an active effect needs them. */
#define LM_CONDITION_FIELD(field, ...) lm_real field;
typedef struct lm_conditions {
  LM_CONDITION_LIST(LM_CONDITION_FIELD, LM_CONDITION_FIELD, LM_CONDITION_FIELD, LM_CONDITION_FIELD)
  lm_real elastic_rad; /* angle of torsion curve and friction at the torque, with effects on the
                          compliance; for LM_EFFECT_WIDTH, before friction has acted, of the curve;
                          set by the model */
  lm_real wound_Nm; /* torque minus friction in parallel with the spring; it winds the drive up and
                       closes gaps in the mesh; set by the model */
} lm_conditions;

/* Initial value: `lm_conditions at = LM_CONDITIONS_UNKNOWN;`. ({0} would mean zero torque at 0
 * degrees Celsius.) */
#define LM_UNKNOWN_OF_STEP(field, NEED, unknown) unknown,
#define LM_UNKNOWN_OF_OTHERS(field, ...) LM_UNKNOWN,
#define LM_CONDITIONS_UNKNOWN                                                        \
  {LM_CONDITION_LIST(LM_UNKNOWN_OF_STEP, LM_UNKNOWN_OF_OTHERS, LM_UNKNOWN_OF_OTHERS, \
                     LM_UNKNOWN_OF_OTHERS) 0,                                        \
   0}

#define LM_COUNT_CONDITION(...) +1
#define LM_CONDITION_COUNT (0 LM_CONDITION_CARD_LIST(LM_COUNT_CONDITION))

#if LM_EFFECT_CARDS
/* What is stated about a condition for people and for programs that read recordings. */
typedef struct lm_condition_card {
  const char *name;     /* field of lm_conditions */
  const char *quantity; /* in recordings, with its unit as suffix, and in results */
  const char *meaning;
  const char *cause;   /* group of the effects that need it */
  lm_real usual[2];    /* usual range; equal ends: it is no axis of a picture */
  lm_real compared[2]; /* two values at which effects differ */
  lm_real recorded[2]; /* permitted range of a column: values outside indicate a wrong unit or a
                            damaged file. Equal ends: it is not recorded but derived */
  uint32_t traits;     /* LM_CONDITION_ bits */
} lm_condition_card;

extern const lm_condition_card lm_condition_cards[LM_CONDITION_COUNT];
#endif

/* Meaning of the number that an effect returns; parameters list effects in this order. */
typedef enum lm_effect_kind {
  LM_EFFECT_TORQUE = 0,
  LM_EFFECT_COMPLIANCE = 1,
  LM_EFFECT_WIDTH = 2,
  LM_EFFECT_ANGLE = 3
} lm_effect_kind;

/* The compliance with all effects on it is between 1 / LM_COMPLIANCE_MAX and LM_COMPLIANCE_MAX
 * times that of the drive. Within it, what the operators follow (model.h) rises with the torque for
 * envelopes up to A / K = 5, the largest of a fit; at half the compliance it would fall. */
#define LM_COMPLIANCE_MAX LM_REAL(1.6)

/* Role of a value in a fit. */
typedef enum lm_value_role {
  LM_VALUE_LINEAR = 0, /* the result, of a width its difference from 1, is proportional to it while
                          the other linear values are zero */
  LM_VALUE_SHAPE = 1,  /* enters nonlinearly */
  LM_VALUE_GIVEN = 2,  /* known property of the drive (its ratio, for example), not estimated */
  LM_VALUE_FIXED = 3   /* a saturation limit that selects a branch: fixed, not estimated */
} lm_value_role;

/* Scale of the start values of a fit; for a given value, its source. */
typedef enum lm_value_scale {
  LM_SCALE_NONE = 0,           /* none: the unit of the value itself */
  LM_SCALE_RATED_TORQUE = 1,   /* rated torque of the drive */
  LM_SCALE_LARGEST_TORQUE = 2, /* largest torque in the recordings */
  LM_SCALE_LARGEST_SPEED = 3,  /* largest input speed in the recordings */
  LM_SCALE_SPEEDS = 4,       /* spread over the recorded input speeds, which are also its bounds */
  LM_SCALE_TIMES = 5,        /* spread over the recorded times, which are also its bounds */
  LM_SCALE_SAMPLE_TIME = 6,  /* time between two samples: smaller values have no effect */
  LM_SCALE_GREATEST = 7,     /* upper bound of the value */
  LM_SCALE_RATIO = 8,        /* given: magnitude of the drive's ratio */
  LM_SCALE_TOOTH_ANGLE = 9,  /* given: pitch angle, rad, of flexspline teeth + 2 */
  LM_SCALE_RATED_WINDUP = 10 /* mean wind-up of the drive at rated torque, rad */
} lm_value_scale;

/* Bits of `traits`. */
#define LM_VALUE_BETWEEN_RUNS 1u  /* dependence on quantities that are constant within a run */
#define LM_VALUE_SIGN_OF_RATIO 2u /* it has the sign of the drive's ratio */
#define LM_VALUE_SIGN_OF_FIRST 4u /* sign of the first value; otherwise it is a different effect */
#define LM_VALUE_SCALES 8u        /* it scales the effect together with the linear values */

#define LM_STARTS_MAX 4 /* start values of one value */

typedef struct lm_effect_value {
  const char *name; /* with its unit as suffix */
  lm_value_role role;
  lm_real typical; /* for a size 20 drive of ratio 100 */
  lm_value_scale scale;
  lm_real
      start[LM_STARTS_MAX]; /* start values divided by the scale, then zeros. All zero: a value in
                               N*m starts at 0.02, 0.1 and 0.5 of the rated torque, any other at a
                               quarter of the typical value, at that value and at four times it */
  uint32_t traits;          /* LM_VALUE_ bits */
  const char *words;        /* description if the name is not sufficient; or 0 */
} lm_effect_value;

/* Remaining fields of a value with default settings. */
#define LM_VALUE_AS_USUAL LM_SCALE_NONE, {0, 0, 0, 0}, 0u, 0

/* Description of an effect. */
typedef struct lm_effect_card {
  const char *name;          /* as in drive files */
  const char *mechanism;     /* one sentence */
  const char *equation;      /* in the names of values and conditions */
  const char *typical_size;  /* for a size 20 drive of ratio 100 */
  const char *confused_with; /* names of confounded effects, separated by commas */
  const char *experiment;    /* what separates them */
  lm_effect_value value[LM_EFFECT_VALUES_MAX];
  const char *absorbed; /* part of the baseline model that absorbs the effect; or 0 */
  uint32_t told_by; /* LM_NEEDS_ bit of the condition whose variation separates it from that part;
                       or 0 */
  int32_t steps;    /* 1: the angle changes in steps of its given value; 0: it does not */
} lm_effect_card;

/* Remaining fields of a card: not absorbed by the baseline model, no steps. */
#define LM_CARD_AS_USUAL 0, 0u, 0

/* Values, memory (starts at zero) and conditions in, one number out. */
typedef lm_real lm_effect_function(const lm_real *value, lm_real *memory, const lm_conditions *at);

typedef struct lm_effect {
  uint32_t id; /* CRC-32 of the name, stored in binary parameters */
  lm_effect_kind kind;
  int32_t value_count;  /* 1 to LM_EFFECT_VALUES_MAX */
  int32_t memory_count; /* length of its memory, >= 0 */
  uint32_t covariates;  /* LM_NEEDS_ bits */
  lm_effect_function *run;
  lm_real bound[LM_EFFECT_VALUES_MAX][2]; /* lower and upper bound of each value */
  const lm_effect_card *card;             /* null where LM_EFFECT_CARDS is 0 */
} lm_effect;

#if LM_EFFECT_CARDS
#define LM_EFFECT_CARD(card) (&(card))
#else
#define LM_EFFECT_CARD(card) 0
#endif

/* The effects of the library in alphabetical order; using this table links all of them. */
extern const lm_effect *const lm_effects[LM_EFFECT_COUNT];

/* Each effect is lm_effect_<name>. */
#define LM_DECLARE_EFFECT(name) extern const lm_effect lm_effect_##name;
LM_EFFECT_LIST(LM_DECLARE_EFFECT)

/* Returns the effect with an id in a table of `count` pointers, or null. */
const lm_effect *lm_find_effect(const lm_effect *const *table, int32_t count, uint32_t id);

/* Checks that an effect can run, and its values [effect->value_count] against the bounds.
 * Errors: LM_NULL ("effect"; "run": it has no function); LM_OUT_OF_RANGE ("kind", "value_count",
 * "memory_count": negative); LM_NOT_FINITE, LM_OUT_OF_RANGE with the fault "value" (low and high
 * are its bounds) or, where the cards are linked, the value's name. */
lm_status lm_check_effect(const lm_effect *effect, const lm_real *value, lm_fault *fault);

/* Columns of a recording, each of `count` samples or null where it was not measured. */
#define LM_CONDITION_COLUMN(field, ...) const lm_real *field;
typedef struct lm_recording {
  int64_t count;
  LM_CONDITION_LIST(LM_CONDITION_COLUMN, LM_CONDITION_COLUMN, LM_CONDITION_COLUMN,
                    LM_CONDITION_COLUMN)
  const lm_real *elastic_rad;
  const lm_real *wound_Nm;
} lm_recording;

/* Returns the conditions at sample k. Null columns give zero; a null temperature gives the
 * reference temperature, a null wound_Nm the torque. */
lm_conditions lm_read_conditions(const lm_recording *recording, int64_t k);

/* Runs an effect over a whole recording: result[count] in the unit of the effect. memory carries
 * its state in and out; set it to zero before the first recording. */
void lm_run_effect(const lm_effect *effect, const lm_real *value, lm_real *memory,
                   const lm_recording *recording, lm_real *result);

LM_END_DECLS

#endif
