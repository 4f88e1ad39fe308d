/* A design problem in plain numbers: variables, limits and objectives.
 *
 * Data flow: spec text (spec.h) -> problem (this struct) -> point (combination of choices and
 * numbers in 0 .. 1) -> figures and limits (evaluate.h) -> local solution (run_task.h) -> tasks and
 * front (search.h) -> certificate (certificate.h).
 *
 * Everything here is double, int or char without pointers, so a problem can be copied, stored and
 * sent as bytes. Lengths mm, angles rad unless a name says otherwise.
 */
#ifndef LOSTMOTION_OPTIMIZER_PROBLEM_H
#define LOSTMOTION_OPTIMIZER_PROBLEM_H

#include "lostmotion/check_list.h"
#include "lostmotion/design_key_list.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What can be fixed, varied or chosen: the dotted keys of a drive file's [design], as listed in
 * lostmotion/design_key_list.h; size-independent forms of two of them; and the grades of the
 * tolerances. */
#define LM_KEY_OF_ROW(id, ...) LM_KEY_##id,
typedef enum lm_key {
  LM_DESIGN_KEYS(LM_KEY_OF_ROW, LM_KEY_OF_ROW) /* in the order of the list, from 0 */
  LM_KEY_SHIFT_DIFFERENCE,   /* teeth.shift_difference = x2 - x1, in place of rigid_shift */
  LM_KEY_DEFLECTION_MODULES, /* generator.deflection_modules = w0 / m, in place of deflection_mm */
  LM_KEY_GRADE,              /* "tolerance.0.grade"; link i is LM_KEY_GRADE + i */
  LM_KEY_COUNT = LM_KEY_GRADE + 32
} lm_key;
#undef LM_KEY_OF_ROW

#define LM_FREE_MAX 24          /* variables with a range */
#define LM_CHOICE_MAX 8         /* variables with a list of values */
#define LM_CHOICE_VALUES_MAX 64 /* values of one list */
#define LM_LINK_MAX 32          /* tolerance links */
#define LM_CHAIN_MAX 8          /* members of the radial and of the torsion chain */
#define LM_OBJECTIVE_MAX 4
#define LM_RATED_LEAST_NM 1e-4
#define LM_RATED_MOST_NM 1e6
#define LM_PHASE_MAX 8       /* tooth phases of the wave generator */
#define LM_LOOP_SAMPLES 2048 /* sampled drives of the quantile inside the search */
#define LM_COMBINATION_MAX 20000
#define LM_START_MAX 64 /* designs that a search begins with */

/* A variable that moves between two bounds. */
typedef struct lm_range {
  int key;
  int whole; /* 1: an integer in the end (a tolerance grade): relaxed first, then rounded */
  double low;
  double high;
} lm_range;

/* A variable that takes one value of a list. */
typedef struct lm_choice {
  int key;
  int count;
  double value[LM_CHOICE_VALUES_MAX];
} lm_choice;

/* A tolerance link whose field follows from an ISO 286 grade: width T = IT(diameter, grade). */
typedef struct lm_graded_link {
  double influence;   /* A of lostmotion/tolerance.h */
  double diameter_mm; /* nominal size; 0: the pitch diameter of the flexspline */
  double position;    /* middle of the field in units of T: +0.5 hole H, -0.5 shaft h, 0 js */
  double offset_mm;   /* added to both deviations */
  double cost_weight; /* cost of this link at IT7; 0 counts as 1 */
  int distribution;   /* lm_distribution */
  int zone;           /* lm_gap_zone */
} lm_graded_link;

/* Computed figures of a design, each a maximum to be minimised. */
typedef enum lm_figure {
  LM_FIGURE_LOST_MOTION = 0,       /* arcmin, reversal at the stated torque, largest over phases */
  LM_FIGURE_TOLERANCE_LOST_MOTION, /* the same at the stated tolerance level */
  LM_FIGURE_COMPLIANCE,            /* arcmin per N m from the stated to the rated torque */
  LM_FIGURE_KINEMATIC_ERROR,       /* arcsec, peak to peak of the loaded output angle over phases */
  LM_FIGURE_STRESS,                /* 1 / fatigue safety */
  LM_FIGURE_COST,                  /* units of one link at IT7 */
  LM_FIGURE_COUNT
} lm_figure;

/* Limits. The first ones are the checks of lostmotion/checks.h. */
#define LM_LIMIT_OF_ROW(id, name, unit, scale, meaning) LM_LIMIT_##id,
typedef enum lm_limit {
  LM_LIMIT_FORM_RADIUS = 0,
  LM_LIMIT_FLEXSPLINE_TIP,
  LM_LIMIT_RIGID_TIP,
  LM_LIMIT_FLEXSPLINE_ROOT,
  LM_LIMIT_RIGID_ROOT,
  LM_LIMIT_DISENGAGEMENT,
  LM_LIMIT_FREE_ASSEMBLY, /* only if requested */
  LM_LIMIT_BENDING_STRESS,
  LM_LIMIT_TORSION_STRESS,
  LM_CAPACITY_CHECKS(LM_LIMIT_OF_ROW) LM_LIMIT_SAFETY,
  LM_LIMIT_OUTER_DIAMETER,
  LM_LIMIT_INTERFERENCE, /* of the radial chain at its tightest */
  LM_LIMIT_GAP,          /* side clearance at every angle, flank and section */
  LM_LIMIT_FIGURE,       /* LM_LIMIT_FIGURE + lm_figure: largest allowed figure */
  LM_LIMIT_COUNT = LM_LIMIT_FIGURE + LM_FIGURE_COUNT
} lm_limit;
#undef LM_LIMIT_OF_ROW

/* Limits without angles have one row each, before the gaps. */
#define LM_SINGLE_ROWS LM_LIMIT_GAP

/* Production level of the tolerance figure and the corner limits. */
typedef enum lm_level {
  LM_LEVEL_WORST = 0,    /* every link at its unfavourable limit, eq (10), (11) */
  LM_LEVEL_PROBABLE = 1, /* root of the sum of squares, t = 3 */
  LM_LEVEL_QUANTILE = 2  /* 99.73 % of sampled drives stay below */
} lm_level;

/* Stated limits; 0 where 0 is not meaningful: not limited. */
typedef struct lm_bounds {
  double safety_factor_min;           /* 1.5 */
  double gap_min_arcmin;              /* 0; < 0 permits preload of the flanks up to this amount */
  double outer_diameter_max_mm;       /* rigid gear (internal) or ring (external), with its rim */
  double interference_max_mm;         /* < 0: not limited */
  double figure_max[LM_FIGURE_COUNT]; /* in the unit of the figure */
  int free_assembly;                  /* 1: assembly with an undeformed flexspline is required */
  int gap_at_worst_corner; /* 1: gaps minus the reduction by the tightest tooth tolerances */
} lm_bounds;

/* Cost of a drive, in units of one toleranced feature at IT7:
 *   sum over links w (T_IT7 / T)^k       reciprocal power model of cost and tolerance
 *   + size  pi/4 d^2 b / 1e4 mm^3        metal and machine time by volume
 *   + generator[type]                    its parts
 * The defaults are round figures for ranking drives of one manufacturer; set your own. */
typedef struct lm_cost_model {
  double tolerance_exponent; /* k, 1 */
  double size;               /* 1 */
  double generator[5];       /* by lm_generator_type: 4, 4, 3, 5, 3 */
} lm_cost_model;

/* A point that the search examines first, such as a design of an earlier one. */
typedef struct lm_start {
  int combination;
  double unit[LM_FREE_MAX];
} lm_start;

typedef struct lm_problem {
  /* the drive */
  double ratio_sign;                 /* +1 or -1: sense of rotation */
  int rigid_gear_turns;              /* 1: the rigid gear is the output, the flexspline is held */
  double rated_torque_Nm;            /* > 0 */
  double value[LM_KEY_COUNT];        /* fixed values; 0 = default of lm_complete_drive */
  unsigned char given[LM_KEY_COUNT]; /* 1: fixed, varied or chosen */
  int radial_count;
  double radial[LM_CHAIN_MAX][4]; /* coefficient, exponent, share, preload */
  int torsion_count;
  double torsion[LM_CHAIN_MAX][2]; /* stiffness, ratio */
  int link_count;
  lm_graded_link link[LM_LINK_MAX];
  /* variables */
  int range_count;
  lm_range range[LM_FREE_MAX];
  int choice_count;
  lm_choice choice[LM_CHOICE_MAX];
  int start_count;
  lm_start start[LM_START_MAX];
  /* objectives and limits */
  int objective_count;
  int objective[LM_OBJECTIVE_MAX]; /* lm_figure; the first one leads */
  double torque_Nm;                /* of the reversal; 0: 4 % of rated torque */
  int phases;                      /* tooth phases, 1 .. 8; 2 */
  int level;                       /* lm_level of tolerance_lost_motion */
  lm_bounds bounds;
  lm_cost_model cost;
  /* budget */
  unsigned int seed;
  int evaluations;      /* budget in plain evaluations; a gradient counts as LM_GRADIENT_CHARGE */
  double damaged_share; /* share of evaluations that return NaN, to test the search; 0 */
  /* made by lm_prepare_problem */
  double deviate[LM_LINK_MAX][LM_LOOP_SAMPLES]; /* deviations in units of tau */
} lm_problem;

/* Where the side clearance is examined: every flank at both edges of the face, at each of these
 * angles. */
#define LM_ANGLE_MAX 96
#define LM_EDGES 2

typedef struct lm_gap_angle {
  double offset_rad;
  int from_junction; /* 1: from the contact half angle, with which it moves; 0: from the axis */
} lm_gap_angle;

typedef struct lm_scan {
  int count;
  int rising; /* number of first angles that are measured from the axis and rise */
  lm_gap_angle angle[LM_ANGLE_MAX];
  int nodes; /* of the neutral line */
} lm_scan;

/* Layout of the results of one evaluation: the branches of each figure (the figure is the largest
 * of them), the single rows by lm_limit, then the gaps: two flanks for each angle and edge, for
 * each end of the overlap, and between the angles where the gap is smallest. */
#define LM_BRANCH_MAX (3 * LM_PHASE_MAX + LM_PHASE_MAX * (LM_PHASE_MAX - 1) + 2)
#define LM_RESULT_MAX (LM_BRANCH_MAX + LM_SINGLE_ROWS + 2 * (LM_ANGLE_MAX + 2) * LM_EDGES)

typedef struct lm_layout {
  int figure_start[LM_FIGURE_COUNT];
  int figure_count[LM_FIGURE_COUNT];
  int single_start;
  int gap_start;
  int gap_count; /* angle slowest, section, then forward, backward; the ends; the vertices */
  int count;
} lm_layout;

#ifdef __cplusplus
}
#endif

#endif
