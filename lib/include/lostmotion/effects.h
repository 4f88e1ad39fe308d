/* Secondary effects: one small interface for all of them, the library's and the user's own.
 *
 * An effect is a constant `lm_effect`: a function of its values, its memory and the conditions of
 * the moment, and what is known about it. The function returns one number:
 *
 *     LM_EFFECT_TORQUE   what it adds to the torque, N*m (sensor offset, scale)
 *     LM_EFFECT_WIDTH    the factor by which it widens the friction bands (grease, temperature)
 *     LM_EFFECT_ANGLE    what it adds to the lost motion, rad (everything else)
 *
 * The same compiled function runs over whole recordings on the desktop (lm_run_effect) and once a
 * tick on the controller. An effect that is not named in the parameters is not linked.
 *
 * A user's own effect is one more constant `lm_effect` in a file of the user's own, named in the
 * parameters (C header) or in the table handed to lm_load_parameters (binary). The function must
 * return a finite number for finite inputs, must not loop without a bound, and keeps whatever it
 * must remember in `memory`, which starts at zero.
 *
 * The library's effects are listed in effect_list.h, one file each under lib/runtime/effects/.
 */
#ifndef LOSTMOTION_EFFECTS_H
#define LOSTMOTION_EFFECTS_H

#include <stdint.h>

#include "lostmotion/effect_list.h"
#include "lostmotion/elementary.h"
#include "lostmotion/profile.h"
#include "lostmotion/real.h"
#include "lostmotion/status.h"

LM_BEGIN_DECLS

#ifndef LM_EFFECT_CARDS
#define LM_EFFECT_CARDS 1 /* 0 or 1: link the effects' descriptions (text); 0 on a controller */
#endif
#if LM_EFFECT_CARDS < 0 || LM_EFFECT_CARDS > 1
#error "lostmotion: LM_EFFECT_CARDS must be 0 or 1"
#endif

#define LM_EFFECT_VALUES_MAX 6 /* values of one effect */
#define LM_COUNT_EFFECT(name) +1
#define LM_EFFECT_COUNT (0 LM_EFFECT_LIST(LM_COUNT_EFFECT)) /* effects of the library */
#define LM_REFERENCE_TEMPERATURE_C LM_REAL(20)              /* where thermal effects are nothing */
#define LM_ANGLE_MAX_RAD LM_REAL(1600) /* input and output angle: a quarter of LM_TURN_MAX_RAD */

/* What a condition is while the host does not know it. A number, so that it passes any compiler;
 * no sensor gives it. */
#define LM_UNKNOWN LM_REAL(3e38)

/* The moment, as far as the host knows it. What is not known stays LM_UNKNOWN, as in
 * LM_CONDITIONS_UNKNOWN: the model then takes nothing for it (the temperature of reference, zero
 * for the rest, the torque before), and says LM_STATE_CONDITION_MISSING where it is needed. */
typedef struct lm_conditions {
  lm_real torque_Nm;        /* external torque on the output shaft; torque.h says where from */
  lm_real input_angle_rad;  /* of the wave generator, wrapped to one turn: beyond LM_ANGLE_MAX_RAD
                             * (254 turns) it counts as not known, and waves as those of zero */
  lm_real output_angle_rad; /* of the output shaft; wrapped or not, the same, and the same limit.
                             * Gap profile: it alone drives the model, as commanded and never
                             * wrapped (model.h; lm_shift_angle for endless turning) */
  lm_real input_velocity_rad_s;
  lm_real output_acceleration_rad_s2;
  lm_real temperature_C;
  lm_real cycles; /* load cycles so far */
  lm_real tilt_moment_Nm;
  lm_real axial_force_N;
  lm_real elapsed_s;   /* since the sample before. The compensator takes 0 or less for the period of
                        * its parameters. Whoever calls the model itself fills it in where creep or
                        * sensor_lag is at work: at 0 the one does not creep, and with the other
                        * the torque never arrives */
  lm_real elastic_rad; /* torsion curve and friction at the torque; the model fills it in */
  lm_real wound_Nm;    /* what friction in parallel with the spring leaves of the torque to wind the
                        * drive    up, with which gaps in the mesh close; the model fills it in */
} lm_conditions;

/* To start from: `lm_conditions at = LM_CONDITIONS_UNKNOWN;`. ({0} would mean a torque of zero at 0
 * degrees Celsius.) */
#define LM_CONDITIONS_UNKNOWN                                              \
  {LM_UNKNOWN, LM_UNKNOWN, LM_UNKNOWN, LM_UNKNOWN, LM_UNKNOWN, LM_UNKNOWN, \
   LM_UNKNOWN, LM_UNKNOWN, LM_UNKNOWN, 0,          0,          0}

/* Bits of `covariates`: the conditions an effect cannot do without. The model hands it these, the
 * rest as not known: zero, the temperature that of reference. */
#define LM_NEEDS_TORQUE 1u
#define LM_NEEDS_INPUT_ANGLE 2u
#define LM_NEEDS_OUTPUT_ANGLE 4u
#define LM_NEEDS_INPUT_VELOCITY 8u
#define LM_NEEDS_OUTPUT_ACCELERATION 16u
#define LM_NEEDS_TEMPERATURE 32u
#define LM_NEEDS_CYCLES 64u
#define LM_NEEDS_TILT_MOMENT 128u
#define LM_NEEDS_AXIAL_FORCE 256u
#define LM_NEEDS_TIME 512u
#define LM_USES_INPUT_VELOCITY 1024u /* where it is stated; can do without */

/* What the number is that an effect returns; parameters list effects in this order. */
typedef enum lm_effect_kind {
  LM_EFFECT_TORQUE = 0,
  LM_EFFECT_WIDTH = 1,
  LM_EFFECT_ANGLE = 2
} lm_effect_kind;

/* How a value enters, for whoever fits it. */
typedef enum lm_value_role {
  LM_VALUE_LINEAR = 0, /* the result is proportional to it, the other linear ones held at zero */
  LM_VALUE_SHAPE = 1,  /* enters in another way */
  LM_VALUE_GIVEN = 2,  /* known of the drive (its ratio, say), not to be fitted */
  LM_VALUE_FIXED = 3   /* a limit that picks a branch: stated, and not moved by a fit */
} lm_value_role;

/* What the start values of a fit are measured by; of a given value, what it is. */
typedef enum lm_value_scale {
  LM_SCALE_NONE = 0,           /* by nothing: they are in the value's own unit */
  LM_SCALE_RATED_TORQUE = 1,   /* of the drive */
  LM_SCALE_LARGEST_TORQUE = 2, /* of the recordings */
  LM_SCALE_LARGEST_SPEED = 3,  /* of the input, of the recordings */
  LM_SCALE_SPEEDS = 4,         /* spread over the speeds of the input that were recorded; the value
                                * is held to these */
  LM_SCALE_TIMES = 5,          /* the same over the times that were recorded */
  LM_SCALE_SAMPLE_TIME = 6,    /* the time between two samples: less of it does nothing */
  LM_SCALE_GREATEST = 7,       /* the greatest that the value may be */
  LM_SCALE_RATIO = 8,          /* given: the size of the drive's ratio */
  LM_SCALE_TOOTH_ANGLE = 9 /* given: angle of a tooth, rad, two teeth more than the flexspline */
} lm_value_scale;

/* Bits of `traits`. */
#define LM_VALUE_BETWEEN_RUNS 1u  /* how the effect depends on what is constant within a run */
#define LM_VALUE_SIGN_OF_RATIO 2u /* it has the sign of the drive's ratio */
#define LM_VALUE_SIGN_OF_FIRST                                                             \
  4u                       /* it has the sign of the first value, or the effect is another \
                            */
#define LM_VALUE_SCALES 8u /* it scales the effect, together with its linear values */

#define LM_STARTS_MAX 4 /* start values of one value */

typedef struct lm_effect_value {
  const char *name; /* with its unit as suffix */
  lm_value_role role;
  lm_real typical; /* for a size 20 drive of ratio 100 */
  lm_value_scale scale;
  lm_real start[LM_STARTS_MAX]; /* of a fit, over the scale, zeros behind them. None: a value in N*m
                                 * starts from 0.02, 0.1 and 0.5 of the rated torque, any other
                                 * from a quarter of what is typical, from that, and from four
                                 * times it */
  uint32_t traits;              /* LM_VALUE_ bits */
  const char *words;            /* what it is, for a reader, where its name does not say it; or 0 */
} lm_effect_value;

/* The end of a value of which there is no more to say. */
#define LM_VALUE_AS_USUAL LM_SCALE_NONE, {0, 0, 0, 0}, 0u, 0

/* What a person needs to know of an effect. */
typedef struct lm_effect_card {
  const char *name;          /* as in drive files */
  const char *mechanism;     /* one sentence */
  const char *equation;      /* in the names of values and conditions */
  const char *typical_size;  /* for a size 20 drive of ratio 100 */
  const char *confused_with; /* names of confounded effects, separated by commas */
  const char *experiment;    /* what separates them */
  lm_effect_value value[LM_EFFECT_VALUES_MAX];
  const char *absorbed; /* by which part of the baseline model, where that fits it anyway; or 0 */
  uint32_t told_by;     /* LM_NEEDS_ bit of what tells it from that part where it varies; or 0 */
  int32_t steps;        /* 1: the angle jumps by its given value and stays; 0: it does not */
} lm_effect_card;

/* The end of a card of an effect that is told from the baseline model and does not jump. */
#define LM_CARD_AS_USUAL 0, 0u, 0

/* Values, memory (starts at zero) and moment in, one number out. */
typedef lm_real lm_effect_function(const lm_real *value, lm_real *memory, const lm_conditions *at);

typedef struct lm_effect {
  uint32_t id; /* CRC-32 of the name: what binary parameters carry */
  lm_effect_kind kind;
  int32_t value_count;  /* 1 to LM_EFFECT_VALUES_MAX */
  int32_t memory_count; /* numbers of memory it needs, >= 0 */
  uint32_t covariates;  /* LM_NEEDS_ bits */
  lm_effect_function *run;
  lm_real bound[LM_EFFECT_VALUES_MAX][2]; /* least and greatest of each value */
  const lm_effect_card *card;             /* null where LM_EFFECT_CARDS is 0 */
} lm_effect;

#if LM_EFFECT_CARDS
#define LM_EFFECT_CARD(card) (&(card))
#else
#define LM_EFFECT_CARD(card) 0
#endif

/* The library's effects in the order of their names; listing the table links them all. */
extern const lm_effect *const lm_effects[LM_EFFECT_COUNT];

/* Each of them: lm_effect_<name>. */
#define LM_DECLARE_EFFECT(name) extern const lm_effect lm_effect_##name;
LM_EFFECT_LIST(LM_DECLARE_EFFECT)

/* The effect with an id, or null, in a table of `count` pointers. */
const lm_effect *lm_find_effect(const lm_effect *const *table, int32_t count, uint32_t id);

/* Checks that an effect can be run, and values [effect->value_count] against its bounds.
 * Errors: LM_NULL ("effect"; "run": it has no function); LM_OUT_OF_RANGE ("kind", "value_count",
 * "memory_count": negative); LM_NOT_FINITE, LM_OUT_OF_RANGE with the fault "value" (low and high
 * are its bounds) or, where the cards are linked, the value's name. */
lm_status lm_check_effect(const lm_effect *effect, const lm_real *value, lm_fault *fault);

/* Columns of a recording, each of `count` samples or null where it was not measured. */
typedef struct lm_recording {
  int64_t count;
  const lm_real *torque_Nm;
  const lm_real *input_angle_rad;
  const lm_real *output_angle_rad;
  const lm_real *input_velocity_rad_s;
  const lm_real *output_acceleration_rad_s2;
  const lm_real *temperature_C;
  const lm_real *cycles;
  const lm_real *tilt_moment_Nm;
  const lm_real *axial_force_N;
  const lm_real *elapsed_s;
  const lm_real *elastic_rad;
  const lm_real *wound_Nm;
} lm_recording;

/* The moment at sample k; columns that are null give zero, the temperature its reference, the wound
 * torque the torque. */
lm_conditions lm_read_conditions(const lm_recording *recording, int64_t k);

/* An effect over a whole recording: result[count] in the effect's own unit. memory carries its
 * state in and out; zero it before the first recording. */
void lm_run_effect(const lm_effect *effect, const lm_real *value, lm_real *memory,
                   const lm_recording *recording, lm_real *result);

LM_END_DECLS

#endif
