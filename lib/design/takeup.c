#include "lostmotion/takeup.h"

#include "real_math.h"
#include "refuse.h"

#define SPRINGS_MAX (4 * LM_LOBE_TEETH_MAX) /* both flanks of both lobes of the largest drive */

/* Limits far beyond any drive, whose products are within the range of float32. */
#define RADIUS_MIN_MM LM_REAL(1e-3)
#define RADIUS_MAX_MM LM_REAL(1e6)
#define STIFFNESS_MIN LM_REAL(1e-9)
#define STIFFNESS_MAX LM_REAL(1e15)
#define TORQUE_MAX_NM LM_REAL(1e9)
#define COMPLIANCE_MAX LM_REAL(1e6)
#define TWIST_MAX LM_REAL(1)

/* --- eq (1) --- */

lm_status lm_stage_increments(const lm_real clearance_mm[], const lm_real radius_mm[], int count,
                              lm_real increment_rad[], int order[], lm_fault *fault) {
  lm_real reached = LM_REAL(0);
  int i;
  int k;
  if (clearance_mm == 0 || radius_mm == 0 || increment_rad == 0 || order == 0) {
    return refuse(fault, LM_NULL, "clearance_mm, radius_mm, increment_rad, order");
  }
  if (count < 1 || count > SPRINGS_MAX) {
    return refuse_range(fault, "count", LM_REAL(count), LM_REAL(1), LM_REAL(SPRINGS_MAX));
  }
  for (i = 0; i < count; i++) {
    lm_status status =
        check_range(fault, "clearance_mm", clearance_mm[i], -RADIUS_MAX_MM, RADIUS_MAX_MM);
    if (status == LM_OK) {
      status = check_range(fault, "radius_mm", radius_mm[i], RADIUS_MIN_MM, RADIUS_MAX_MM);
    }
    if (status != LM_OK) {
      return status;
    }
  }
  for (i = 0; i < count; i++) {
    const lm_real gap = clearance_mm[i] / radius_mm[i];
    k = i;
    while (k > 0 && increment_rad[k - 1] > gap) {
      increment_rad[k] = increment_rad[k - 1];
      order[k] = order[k - 1];
      k--;
    }
    increment_rad[k] = gap;
    order[k] = i;
  }
  for (i = 0; i < count; i++) {
    const lm_real gap = increment_rad[i];
    increment_rad[i] = gap - reached;
    reached = gap;
  }
  return LM_OK;
}

/* --- independent pairs --- */

/* Rotation at which a spring begins (forward) or ceases (backward) to carry on the way up. */
static lm_real spring_event(const lm_spring *spring) {
  return LM_REAL(spring->side) * spring->gap_rad;
}

static lm_status check_springs(const lm_spring springs[], int count, lm_fault *fault) {
  int i;
  for (i = 0; i < count; i++) {
    lm_status status = check_range(fault, "stiffness_Nm_per_rad", springs[i].stiffness_Nm_per_rad,
                                   STIFFNESS_MIN, STIFFNESS_MAX);
    if (status == LM_OK) {
      status = check_range(fault, "gap_rad", springs[i].gap_rad, -LM_PI, LM_PI);
    }
    if (status == LM_OK && springs[i].side != 1 && springs[i].side != -1) {
      status = refuse_range(fault, "side", LM_REAL(springs[i].side), LM_REAL(-1), LM_REAL(1));
    }
    if (status != LM_OK) {
      return status;
    }
  }
  return LM_OK;
}

static void sort_springs(lm_spring springs[], int count) {
  int i;
  for (i = 1; i < count; i++) {
    const lm_spring moved = springs[i];
    int k = i;
    while (k > 0 && spring_event(&springs[k - 1]) > spring_event(&moved)) {
      springs[k] = springs[k - 1];
      k--;
    }
    springs[k] = moved;
  }
}

/* The middle of the free play, if the last backward spring ceases to carry before the first forward
 * one begins. Sorted springs. */
static int middle_of_play(const lm_spring springs[], int count, lm_real *angle_rad) {
  lm_real last_backward = -REAL_INFINITY;
  lm_real first_forward = REAL_INFINITY;
  int i;
  for (i = 0; i < count; i++) {
    const lm_real event = spring_event(&springs[i]);
    if (springs[i].side < 0) {
      last_backward = event;
    } else if (event < first_forward) {
      first_forward = event;
    }
  }
  *angle_rad = (last_backward + first_forward) / LM_REAL(2);
  return last_backward <= first_forward && real_isfinite(*angle_rad);
}

lm_status lm_independent_take_up(lm_spring springs[], int count, lm_real torque_Nm,
                                 lm_real *angle_rad, int *engaged, lm_fault *fault) {
  lm_real slope = LM_REAL(0);  /* stiffness between two events */
  lm_real moment = LM_REAL(0); /* sum of K times event over the springs that carry */
  lm_real middle;
  lm_status status;
  int carrying = 0;
  int i;
  if (springs == 0 || angle_rad == 0 || engaged == 0) {
    return refuse(fault, LM_NULL, "springs, angle_rad, engaged");
  }
  if (count < 1 || count > SPRINGS_MAX) {
    return refuse_range(fault, "count", LM_REAL(count), LM_REAL(1), LM_REAL(SPRINGS_MAX));
  }
  status = check_range(fault, "torque_Nm", torque_Nm, -TORQUE_MAX_NM, TORQUE_MAX_NM);
  if (status == LM_OK) {
    status = check_springs(springs, count, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  sort_springs(springs, count);
  if (torque_Nm == LM_REAL(0) && middle_of_play(springs, count, &middle)) {
    *angle_rad = middle;
    *engaged = 0;
    return LM_OK;
  }
  for (i = 0; i < count; i++) {
    if (springs[i].side < 0) {
      slope += springs[i].stiffness_Nm_per_rad;
      moment += springs[i].stiffness_Nm_per_rad * spring_event(&springs[i]);
      carrying++;
    }
  }
  if (carrying == 0 && torque_Nm < LM_REAL(0)) {
    return refuse(fault, LM_NO_CONTACT, "springs");
  }
  /* Between two events T = slope phi - moment; go up to the section that contains the torque. Where
   * the last spring ceases to carry, the torque is exactly zero: rounding must neither leave a
   * small torque in the play nor a stiffness. */
  for (i = 0; i < count; i++) {
    const lm_real event = spring_event(&springs[i]);
    const int left = carrying + springs[i].side; /* one begins or ceases to carry */
    if (carrying > 0 && torque_Nm <= (left == 0 ? LM_REAL(0) : slope * event - moment)) {
      break;
    }
    carrying = left;
    slope += LM_REAL(springs[i].side) * springs[i].stiffness_Nm_per_rad;
    moment += LM_REAL(springs[i].side) * springs[i].stiffness_Nm_per_rad * event;
    if (carrying == 0) {
      slope = LM_REAL(0);
      moment = LM_REAL(0);
    }
  }
  if (carrying == 0) {
    return refuse(fault, LM_NO_CONTACT, "springs");
  }
  *angle_rad = (torque_Nm + moment) / slope;
  *engaged = carrying;
  return LM_OK;
}

/* --- coupled pairs --- */

lm_status lm_beam_yield(lm_real foundation_N_per_mm2, lm_real stiffness_N_mm2, lm_real spacing_mm,
                        lm_real factor, int teeth, lm_real yield_mm_per_N[], lm_fault *fault) {
  const lm_real large = LM_REAL(1e15);
  const lm_real small = LM_REAL(1e-12);
  lm_real lambda;
  lm_status status;
  int i;
  if (yield_mm_per_N == 0) {
    return refuse(fault, LM_NULL, "yield_mm_per_N");
  }
  status = check_range(fault, "support.foundation_N_per_mm2", foundation_N_per_mm2, small, large);
  if (status == LM_OK) {
    status = check_range(fault, "support.ring_stiffness_N_mm2", stiffness_N_mm2, small, large);
  }
  if (status == LM_OK) {
    status = check_range(fault, "spacing_mm", spacing_mm, small, large);
  }
  if (status == LM_OK) {
    status = check_range(fault, "support.ring_factor", factor, LM_REAL(0), LM_REAL(1e6));
  }
  if (status == LM_OK) {
    status = check_range(fault, "teeth", LM_REAL(teeth), LM_REAL(1), LM_REAL(LM_LOBE_TEETH_MAX));
  }
  if (status != LM_OK) {
    return status;
  }
  lambda = real_sqrt(real_sqrt(foundation_N_per_mm2 / (LM_REAL(4) * stiffness_N_mm2)));
  for (i = 0; i < teeth; i++) {
    const lm_real x = lambda * spacing_mm * LM_REAL(i);
    yield_mm_per_N[i] = factor * lambda / (LM_REAL(2) * foundation_N_per_mm2) * real_exp(-x) *
                        (real_cos(x) + real_sin(x));
  }
  return LM_OK;
}

lm_real lm_rim_yield(const lm_foundation *foundation, int tooth, int other) {
  lm_real give = foundation->yield_mm_per_N[tooth > other ? tooth - other : other - tooth];
  int k;
  for (k = 0; k < foundation->supports; k++) {
    give -= foundation->hold[tooth][k] * foundation->hold[other][k];
  }
  return give;
}

/* State of the path follower. */
typedef struct path {
  const lm_contact *contacts;
  int count;
  int far;            /* contacts behind them that are to stay open */
  int touched;        /* one of these does not */
  lm_real middle_rad; /* angle at rest */
  const lm_foundation *foundation;
  lm_take_up_workspace *w;
  lm_real multiplicity; /* 2 if one lobe represents both */
  int first_tooth;      /* range of teeth that any contact uses */
  int last_tooth;
  int events_left; /* number of further pairs that may join or leave on this path */
} path;

static void range_of_teeth(path *p) {
  int i;
  p->first_tooth = p->contacts[0].tooth;
  p->last_tooth = p->contacts[0].tooth;
  for (i = 1; i < p->count; i++) {
    const int tooth = p->contacts[i].tooth;
    p->first_tooth = tooth < p->first_tooth ? tooth : p->first_tooth;
    p->last_tooth = tooth > p->last_tooth ? tooth : p->last_tooth;
  }
}

/* How the distance of each pair changes along the path parameter. */
typedef enum direction {
  CLOSE_BOTH, /* both flanks close together: the preload is applied */
  TURN_UP,    /* the output turns forward */
  TURN_DOWN
} direction;

static lm_real advance(const lm_contact *contact, direction way) {
  if (way == CLOSE_BOTH) {
    return contact->arm_mm;
  }
  return way == TURN_UP ? LM_REAL(contact->side) * contact->arm_mm
                        : -LM_REAL(contact->side) * contact->arm_mm;
}

/* Element of C: displacement of contact i along its approach for a unit force at contact j. */
static lm_real coupling(const path *p, const lm_contact *a, const lm_contact *b) {
  const lm_real twist = p->foundation->twist_rad_per_Nmm[a->section][b->section] * p->multiplicity;
  lm_real give = LM_REAL(a->side * b->side) * a->arm_mm * b->arm_mm * twist;
  if (a->lobe == b->lobe) {
    give += a->wedge * b->wedge * lm_rim_yield(p->foundation, a->tooth, b->tooth);
  }
  return give;
}

/* --- Cholesky factor of C over the active pairs, packed by rows --- */

static lm_real *row(lm_take_up_workspace *w, int i) {
  return w->factor + i * (i + 1) / 2;
}

static lm_status append_pair(path *p, int contact, lm_fault *fault) {
  lm_take_up_workspace *w = p->w;
  const lm_contact *added = &p->contacts[contact];
  const int k = w->active_count;
  lm_real *last;
  lm_real diagonal = added->compliance_mm_per_N + coupling(p, added, added);
  int i;
  int j;
  if (k == LM_ACTIVE_MAX) {
    return refuse_capacity(fault, "LM_ACTIVE_MAX", LM_ACTIVE_MAX, LM_ACTIVE_MAX + 1);
  }
  last = row(w, k);
  for (i = 0; i < k; i++) {
    const lm_real *upper = row(w, i);
    lm_real sum = coupling(p, added, &p->contacts[w->active[i]]);
    for (j = 0; j < i; j++) {
      sum -= upper[j] * last[j];
    }
    last[i] = sum / upper[i];
    diagonal -= last[i] * last[i];
  }
  if (!(diagonal > LM_REAL(0))) {
    return refuse(fault, LM_NOT_CONVERGED, "compliance_mm_per_N");
  }
  last[k] = real_sqrt(diagonal);
  w->active[k] = contact;
  w->place[contact] = k;
  w->force[k] = LM_REAL(0);
  w->active_count = k + 1;
  return LM_OK;
}

/* Remove pair number k from the factor: rotate the columns that are no longer triangular, then move
 * the rows up.
 */
static void remove_pair(path *p, int k) {
  lm_take_up_workspace *w = p->w;
  const int m = w->active_count;
  int i;
  int j;
  for (j = k; j < m - 1; j++) {
    const lm_real a = row(w, j + 1)[j];
    const lm_real b = row(w, j + 1)[j + 1];
    const lm_real r = real_sqrt(a * a + b * b);
    for (i = j + 1; i < m; i++) {
      lm_real *x = row(w, i);
      const lm_real left = x[j];
      const lm_real right = x[j + 1];
      x[j] = (a * left + b * right) / r;
      x[j + 1] = (a * right - b * left) / r;
    }
  }
  w->place[w->active[k]] = -1;
  w->slack_mm[w->active[k]] = LM_REAL(0);
  for (i = k; i < m - 1; i++) {
    for (j = 0; j <= i; j++) {
      row(w, i)[j] = row(w, i + 1)[j];
    }
    w->active[i] = w->active[i + 1];
    w->force[i] = w->force[i + 1];
    w->place[w->active[i]] = i;
  }
  w->active_count = m - 1;
}

/* Change of the forces along the path: C rate = advance, over the active pairs. */
static void solve_rates(path *p, direction way) {
  lm_take_up_workspace *w = p->w;
  int i;
  int j;
  for (i = 0; i < w->active_count; i++) {
    const lm_real *l = row(w, i);
    lm_real sum = advance(&p->contacts[w->active[i]], way);
    for (j = 0; j < i; j++) {
      sum -= l[j] * w->rate[j];
    }
    w->rate[i] = sum / l[i];
  }
  for (i = w->active_count - 1; i >= 0; i--) {
    const lm_real *l = row(w, i);
    w->rate[i] /= l[i];
    for (j = 0; j < i; j++) {
      w->rate[j] -= l[j] * w->rate[i];
    }
  }
}

/* --- effect of a set of pair forces on the rim --- */

/* Rotation of each axial section from the torques in all of them. */
static void turn_sections(const path *p, const lm_real torque_Nmm[LM_SECTIONS_MAX],
                          lm_real turn_rad[LM_SECTIONS_MAX]) {
  int s;
  int from;
  for (s = 0; s < p->foundation->sections; s++) {
    turn_rad[s] = LM_REAL(0);
    for (from = 0; from < p->foundation->sections; from++) {
      turn_rad[s] += p->foundation->twist_rad_per_Nmm[s][from] * torque_Nmm[from];
    }
  }
}

/* Reduction of the rim's deflection by its supports, for forces on the active pairs. */
static void take_off_supports(path *p, const lm_real force[], int lobe) {
  lm_take_up_workspace *w = p->w;
  const lm_foundation *f = p->foundation;
  lm_real held[LM_SUPPORTS_MAX];
  int i;
  int k;
  for (k = 0; k < f->supports; k++) {
    held[k] = LM_REAL(0);
  }
  for (i = 0; i < w->active_count; i++) {
    const lm_contact *c = &p->contacts[w->active[i]];
    for (k = 0; k < f->supports && c->lobe == lobe; k++) {
      held[k] += c->wedge * force[i] * f->hold[c->tooth][k];
    }
  }
  for (i = p->first_tooth; i <= p->last_tooth; i++) {
    for (k = 0; k < f->supports; k++) {
      w->give[lobe][i] -= held[k] * f->hold[i][k];
    }
  }
}

/* Radial deflection of every rim (w->give) and rotation of every section from forces on the active
 * pairs. */
static void spread(path *p, const lm_real force[], lm_real turn_rad[LM_SECTIONS_MAX]) {
  lm_take_up_workspace *w = p->w;
  lm_real torque_Nmm[LM_SECTIONS_MAX];
  int lobe;
  int i;
  int s;
  for (s = 0; s < p->foundation->sections; s++) {
    torque_Nmm[s] = LM_REAL(0);
  }
  for (lobe = 0; lobe < p->foundation->lobes; lobe++) {
    for (i = p->first_tooth; i <= p->last_tooth; i++) {
      w->give[lobe][i] = LM_REAL(0);
    }
  }
  for (i = 0; i < w->active_count; i++) {
    const lm_contact *c = &p->contacts[w->active[i]];
    const lm_real radial = c->wedge * force[i];
    lm_real *give = w->give[c->lobe];
    int tooth;
    for (tooth = p->first_tooth; tooth < c->tooth; tooth++) {
      give[tooth] += radial * p->foundation->yield_mm_per_N[c->tooth - tooth];
    }
    for (tooth = c->tooth; tooth <= p->last_tooth; tooth++) {
      give[tooth] += radial * p->foundation->yield_mm_per_N[tooth - c->tooth];
    }
    torque_Nmm[c->section] += LM_REAL(c->side) * c->arm_mm * force[i] * p->multiplicity;
  }
  for (lobe = 0; lobe < p->foundation->lobes && p->foundation->supports > 0; lobe++) {
    take_off_supports(p, force, lobe);
  }
  turn_sections(p, torque_Nmm, turn_rad);
}

/* Deflection of the rim at a pair, along its approach. */
static lm_real rim_give(const path *p, const lm_contact *c, const lm_real turn_rad[]) {
  return c->wedge * p->w->give[c->lobe][c->tooth] +
         LM_REAL(c->side) * c->arm_mm * turn_rad[c->section];
}

/* Torque at the output from forces (or their rates) of the active pairs. */
static lm_real torque_of(const path *p, const lm_real force[]) {
  lm_real sum = LM_REAL(0);
  int i;
  for (i = 0; i < p->w->active_count; i++) {
    const lm_contact *c = &p->contacts[p->w->active[i]];
    sum += LM_REAL(c->side) * c->arm_mm * force[i];
  }
  return sum * p->multiplicity / LM_MM_PER_M;
}

/* --- following the path --- */

/* The next event along the path: its distance, and the pair that joins (or leaves, if it is
 * active). pair = -1: no further event. */
typedef struct event {
  lm_real distance;
  int pair;
} event;

/* Fills w->rate; approach[] is the closing rate of each pair that does not carry. */
static event next_event(path *p, direction way) {
  lm_take_up_workspace *w = p->w;
  lm_real turn_rad[LM_SECTIONS_MAX];
  event next;
  int i;
  next.distance = REAL_INFINITY;
  next.pair = -1;
  solve_rates(p, way);
  spread(p, w->rate, turn_rad);
  for (i = 0; i < w->active_count; i++) {
    if (w->rate[i] < LM_REAL(0) && w->force[i] < -w->rate[i] * next.distance) {
      next.distance = -w->force[i] / w->rate[i];
      next.pair = w->active[i];
    }
  }
  for (i = 0; i < p->count; i++) {
    if (w->place[i] < 0) {
      const lm_contact *c = &p->contacts[i];
      const lm_real approach = advance(c, way) - rim_give(p, c, turn_rad);
      w->approach[i] = approach;
      if (approach > LM_REAL(0) && w->slack_mm[i] < approach * next.distance) {
        next.distance = w->slack_mm[i] > LM_REAL(0) ? w->slack_mm[i] / approach : LM_REAL(0);
        next.pair = i;
      }
    }
  }
  return next;
}

/* Advance along the path with the rates from next_event. */
static void go(path *p, lm_real distance) {
  lm_take_up_workspace *w = p->w;
  int i;
  for (i = 0; i < w->active_count; i++) {
    w->force[i] += w->rate[i] * distance;
  }
  for (i = 0; i < p->count; i++) {
    if (w->place[i] < 0) {
      w->slack_mm[i] -= w->approach[i] * distance;
    }
  }
}

/* Every pair joins and leaves a few times at most; more events than this mean that rounding
 * dominates, or that the foundation is inconsistent. */
static void allow_events(path *p) {
  p->events_left = 8 * p->count + 64;
}

static lm_status switch_pair(path *p, int pair, lm_fault *fault) {
  if (p->events_left == 0) {
    return refuse(fault, LM_NOT_CONVERGED, "contacts");
  }
  p->events_left--;
  if (p->w->place[pair] < 0) {
    return append_pair(p, pair, fault);
  }
  remove_pair(p, p->w->place[pair]);
  return LM_OK;
}

/* Start with no force at `angle`, each pair at its own distance less `relief`. */
static void start_open(path *p, lm_real angle, lm_real relief) {
  int i;
  p->w->active_count = 0;
  for (i = 0; i < p->count; i++) {
    const lm_contact *c = &p->contacts[i];
    p->w->place[i] = -1;
    p->w->slack_mm[i] = c->arm_mm * (c->gap_rad - LM_REAL(c->side) * angle + relief);
  }
}

/* Apply the preload: both flanks close by `relief` until the gaps have their true values. */
static lm_status let_preload_in(path *p, lm_real relief, lm_fault *fault) {
  lm_real left = relief;
  for (;;) {
    const event next = next_event(p, CLOSE_BOTH);
    lm_status status;
    if (!(next.distance < left)) {
      go(p, left);
      return LM_OK;
    }
    go(p, next.distance);
    left -= next.distance;
    status = switch_pair(p, next.pair, fault);
    if (status != LM_OK) {
      return status;
    }
  }
}

/* Rotate from the present state until the torque is zero; *angle is updated. */
static lm_status turn_to_rest(path *p, lm_real *angle, lm_fault *fault) {
  const direction way = torque_of(p, p->w->force) > LM_REAL(0) ? TURN_DOWN : TURN_UP;
  const lm_real sign = way == TURN_UP ? LM_REAL(1) : LM_REAL(-1);
  for (;;) {
    const event next = next_event(p, way);
    const lm_real to_rest = -torque_of(p, p->w->force) / torque_of(p, p->w->rate);
    lm_status status;
    if (!(next.distance < to_rest)) {
      go(p, to_rest);
      *angle += sign * to_rest;
      return LM_OK;
    }
    go(p, next.distance);
    *angle += sign * next.distance;
    status = switch_pair(p, next.pair, fault);
    if (status != LM_OK) {
      return status;
    }
  }
}

/* The gaps of both flanks determine the rest position: with free play it is its middle, without
 * force; with preload it is the equilibrium of both flanks. */
static lm_status find_rest(path *p, lm_rest *rest, lm_fault *fault) {
  lm_real forward = REAL_INFINITY;
  lm_real backward = REAL_INFINITY;
  lm_status status;
  lm_real angle;
  int i;
  allow_events(p);
  for (i = 0; i < p->count; i++) {
    const lm_contact *c = &p->contacts[i];
    if (c->side > 0) {
      forward = c->gap_rad < forward ? c->gap_rad : forward;
    } else {
      backward = c->gap_rad < backward ? c->gap_rad : backward;
    }
  }
  if (!real_isfinite(forward) || !real_isfinite(backward)) {
    return refuse(fault, LM_NO_CONTACT, "contacts");
  }
  angle = (forward - backward) / LM_REAL(2);
  rest->free_play_rad = (forward + backward) / LM_REAL(2);
  if (rest->free_play_rad >= LM_REAL(0)) {
    start_open(p, angle, LM_REAL(0));
  } else {
    start_open(p, angle, -rest->free_play_rad);
    status = let_preload_in(p, -rest->free_play_rad, fault);
    if (status == LM_OK) {
      status = turn_to_rest(p, &angle, fault);
    }
    if (status != LM_OK) {
      return status;
    }
    rest->free_play_rad = LM_REAL(0);
  }
  rest->middle_rad = angle;
  rest->preloaded = p->w->active_count;
  return LM_OK;
}

/* Store the rest state, from which both directions start. */
static void keep_rest(path *p) {
  lm_take_up_workspace *w = p->w;
  int i;
  w->rest_active_count = w->active_count;
  for (i = 0; i < w->active_count; i++) {
    w->rest_active[i] = w->active[i];
  }
  for (i = 0; i < w->active_count * (w->active_count + 1) / 2; i++) {
    w->rest_factor[i] = w->factor[i];
  }
  for (i = 0; i < p->count; i++) {
    w->rest_force[i] = w->place[i] < 0 ? LM_REAL(0) : w->force[w->place[i]];
    w->rest_slack_mm[i] = w->place[i] < 0 ? w->slack_mm[i] : LM_REAL(0);
  }
}

static void return_to_rest(path *p) {
  lm_take_up_workspace *w = p->w;
  int i;
  for (i = 0; i < p->count; i++) {
    w->place[i] = -1;
    w->slack_mm[i] = w->rest_slack_mm[i];
  }
  w->active_count = w->rest_active_count;
  for (i = 0; i < w->active_count; i++) {
    w->active[i] = w->rest_active[i];
    w->place[w->active[i]] = i;
    w->force[i] = w->rest_force[w->active[i]];
  }
  for (i = 0; i < w->active_count * (w->active_count + 1) / 2; i++) {
    w->factor[i] = w->rest_factor[i];
  }
}

/* Teeth that carry on a flank, in any section, of the lobe where more do. */
static int count_teeth(const path *p, int side) {
  unsigned char seen[2][LM_LOBE_TEETH_MAX] = {{0}};
  int teeth[2] = {0, 0};
  int i;
  for (i = 0; i < p->w->active_count; i++) {
    const lm_contact *c = &p->contacts[p->w->active[i]];
    if (c->side == side && seen[c->lobe][c->tooth] == 0) {
      seen[c->lobe][c->tooth] = 1;
      teeth[c->lobe]++;
    }
  }
  return teeth[0] > teeth[1] ? teeth[0] : teeth[1];
}

/* Share of the twist: sum over the sections of rotation times torque, both since rest. */
static lm_real twist_work(const path *p) {
  const lm_take_up_workspace *w = p->w;
  lm_real torque_Nmm[LM_SECTIONS_MAX] = {LM_REAL(0)};
  lm_real turn_rad[LM_SECTIONS_MAX];
  lm_real work = LM_REAL(0);
  int i;
  for (i = 0; i < p->count; i++) {
    const lm_contact *c = &p->contacts[i];
    const lm_real change = w->place[i] < 0 ? -w->rest_force[i] : w->change[w->place[i]];
    torque_Nmm[c->section] += LM_REAL(c->side) * c->arm_mm * change * p->multiplicity;
  }
  turn_sections(p, torque_Nmm, turn_rad);
  for (i = 0; i < p->foundation->sections; i++) {
    work += turn_rad[i] * torque_Nmm[i];
  }
  return work;
}

/* Whether the contacts that are left out stay open in a state: the rest turned by the angle, forces
 * on the active pairs. Their gaps are lower bounds and their flank angles rough, so what the rim
 * closes counts twice. */
static void watch_far(path *p, const lm_real force[], lm_real angle) {
  lm_real turn_rad[LM_SECTIONS_MAX];
  path wide = *p;
  int i;
  if (p->far == 0) {
    return;
  }
  wide.count = p->count + p->far;
  range_of_teeth(&wide);
  spread(&wide, force, turn_rad);
  for (i = p->count; i < wide.count; i++) {
    const lm_contact *c = &p->contacts[i];
    const lm_real opened = c->wedge * p->w->give[c->lobe][c->tooth];
    const lm_real slack = c->arm_mm * (c->gap_rad - LM_REAL(c->side) * angle) +
                          LM_REAL(c->side) * c->arm_mm * turn_rad[c->section] +
                          (opened < LM_REAL(0) ? LM_REAL(2) * opened : LM_REAL(0));
    p->touched |= !(slack > LM_REAL(0));
  }
}

/* The state `distance` further along the path. Work from rest, by force change dF and torque dT:
 *   dT dphi = sum dF C dF + sum over joined pairs F slack(rest) + sum over left pairs F(rest)
 * slack, which is exact because a pair that carries in both states moves by C dF alone. */
static void report_state(path *p, lm_real angle, lm_real distance, lm_real torque_Nm,
                         lm_take_up *state) {
  lm_take_up_workspace *w = p->w;
  const lm_real scale = torque_Nm * LM_MM_PER_M / p->multiplicity;
  lm_real force[LM_ACTIVE_MAX];
  lm_real clearance = LM_REAL(0);
  lm_real tooth = LM_REAL(0);
  int i;
  for (i = 0; i < p->count; i++) {
    if (w->place[i] < 0 && w->rest_force[i] > LM_REAL(0)) {
      const lm_real slack = w->slack_mm[i] - w->approach[i] * distance;
      clearance += w->rest_force[i] * slack;
      tooth += w->rest_force[i] * w->rest_force[i] * p->contacts[i].compliance_mm_per_N;
    }
  }
  for (i = 0; i < w->active_count; i++) {
    const int pair = w->active[i];
    /* In this order the change keeps its digits for any small torque. */
    const lm_real change = (w->force[i] - w->rest_force[pair]) + w->rate[i] * distance;
    w->change[i] = change;
    clearance += change * w->rest_slack_mm[pair];
    tooth += change * change * p->contacts[pair].compliance_mm_per_N;
  }
  state->angle_rad = angle;
  state->clearance_rad = clearance / scale;
  state->tooth_rad = tooth / scale;
  state->twist_rad = twist_work(p) / (torque_Nm * LM_MM_PER_M);
  state->ring_rad = angle - state->clearance_rad - state->tooth_rad - state->twist_rad;
  state->stiffness_Nm_per_rad = real_fabs(torque_of(p, w->rate));
  state->forward_teeth = count_teeth(p, 1);
  state->backward_teeth = count_teeth(p, -1);
  for (i = 0; i < w->active_count; i++) {
    force[i] = w->force[i] + w->rate[i] * distance;
  }
  watch_far(p, force, p->middle_rad + angle);
}

/* The unloaded state: no rotation, the stiffness of the pairs that carry without load. */
static void report_rest(path *p, lm_take_up *state) {
  (void)next_event(p, TURN_UP);
  state->angle_rad = LM_REAL(0);
  state->clearance_rad = LM_REAL(0);
  state->tooth_rad = LM_REAL(0);
  state->ring_rad = LM_REAL(0);
  state->twist_rad = LM_REAL(0);
  state->stiffness_Nm_per_rad = torque_of(p, p->w->rate);
  state->forward_teeth = count_teeth(p, 1);
  state->backward_teeth = count_teeth(p, -1);
}

static void record_stage(path *p, lm_real torque_Nm, lm_real angle, const event *next) {
  lm_take_up_workspace *w = p->w;
  if (w->stage_count < LM_STAGES_MAX) {
    lm_stage *stage = &w->stages[w->stage_count++];
    stage->torque_Nm = torque_Nm;
    stage->angle_rad = angle;
    stage->contact = next->pair;
    stage->joined = w->place[next->pair] < 0;
  }
}

/* From rest through the torques first, first + step, ... last, which grow away from zero. Torques
 * are relative to the rounding error of the preload's equilibrium. */
static lm_status follow(path *p, direction way, const lm_real torque_Nm[], int first, int last,
                        lm_take_up states[], lm_fault *fault) {
  const int step = way == TURN_UP ? 1 : -1;
  const lm_real sign = LM_REAL(step);
  const lm_real balance = torque_of(p, p->w->force);
  lm_real angle = LM_REAL(0);
  int wanted = first;
  allow_events(p);
  for (;;) {
    const event next = next_event(p, way);
    const lm_real torque = torque_of(p, p->w->force) - balance;
    const lm_real rate = torque_of(p, p->w->rate);
    lm_status status;
    while (p->w->active_count > 0 && !((torque_Nm[wanted] - torque) / rate > next.distance)) {
      const lm_real distance = (torque_Nm[wanted] - torque) / rate;
      report_state(p, angle + sign * distance, distance, torque_Nm[wanted], &states[wanted]);
      if (wanted == last) {
        return LM_OK;
      }
      wanted += step;
    }
    go(p, next.distance);
    angle += sign * next.distance;
    record_stage(p, torque_of(p, p->w->force) - balance, angle, &next);
    status = switch_pair(p, next.pair, fault);
    if (status != LM_OK) {
      return status;
    }
  }
}

static lm_status check_contacts(const lm_contact contacts[], int count,
                                const lm_foundation *foundation, lm_fault *fault) {
  int i;
  if (foundation->sections < 1 || foundation->sections > LM_SECTIONS_MAX) {
    return refuse_range(fault, "sections", LM_REAL(foundation->sections), LM_REAL(1),
                        LM_REAL(LM_SECTIONS_MAX));
  }
  if (foundation->lobes < 1 || foundation->lobes > 2) {
    return refuse_range(fault, "lobes", LM_REAL(foundation->lobes), LM_REAL(1), LM_REAL(2));
  }
  for (i = 0; i < count; i++) {
    const lm_contact *c = &contacts[i];
    const lm_real least = LM_REAL(1e-12);
    lm_status status = check_range(fault, "arm_mm", c->arm_mm, RADIUS_MIN_MM, RADIUS_MAX_MM);
    if (status == LM_OK) {
      status = check_range(fault, "wedge", c->wedge, LM_REAL(0), LM_REAL(1e6));
    }
    if (status == LM_OK) {
      status = check_range(fault, "gap_rad", c->gap_rad, -LM_PI, LM_PI);
    }
    if (status == LM_OK) {
      status =
          check_range(fault, "compliance_mm_per_N", c->compliance_mm_per_N, least, COMPLIANCE_MAX);
    }
    if (status == LM_OK) {
      status = check_range(fault, "tooth", LM_REAL(c->tooth), LM_REAL(0),
                           LM_REAL(LM_LOBE_TEETH_MAX - 1));
    }
    if (status == LM_OK) {
      status =
          check_range(fault, "lobe", LM_REAL(c->lobe), LM_REAL(0), LM_REAL(foundation->lobes - 1));
    }
    if (status == LM_OK) {
      status = check_range(fault, "section", LM_REAL(c->section), LM_REAL(0),
                           LM_REAL(foundation->sections - 1));
    }
    if (status == LM_OK && c->side != 1 && c->side != -1) {
      status = refuse_range(fault, "side", LM_REAL(c->side), LM_REAL(-1), LM_REAL(1));
    }
    if (status != LM_OK) {
      return status;
    }
  }
  return LM_OK;
}

static lm_status check_torques(const lm_real torque_Nm[], int torques, lm_fault *fault) {
  int i;
  for (i = 0; i < torques; i++) {
    const lm_status status =
        check_range(fault, "torque_Nm", torque_Nm[i], -TORQUE_MAX_NM, TORQUE_MAX_NM);
    if (status != LM_OK) {
      return status;
    }
    if (i > 0 && !(torque_Nm[i] > torque_Nm[i - 1])) {
      return refuse(fault, LM_NOT_MONOTONE, "torque_Nm");
    }
  }
  return LM_OK;
}

/* Part of the foundation used by the contacts. */
static lm_status check_foundation(const path *p, lm_fault *fault) {
  const lm_foundation *f = p->foundation;
  lm_status status;
  int i;
  int j;
  status =
      check_range(fault, "supports", LM_REAL(f->supports), LM_REAL(0), LM_REAL(LM_SUPPORTS_MAX));
  for (i = p->first_tooth; i <= p->last_tooth && status == LM_OK; i++) {
    for (j = 0; j < f->supports && status == LM_OK; j++) {
      status = check_range(fault, "hold", f->hold[i][j], -COMPLIANCE_MAX, COMPLIANCE_MAX);
    }
  }
  for (i = 0; status == LM_OK && i <= p->last_tooth - p->first_tooth; i++) {
    status =
        check_range(fault, "yield_mm_per_N", f->yield_mm_per_N[i], -COMPLIANCE_MAX, COMPLIANCE_MAX);
  }
  for (i = 0; i < f->sections; i++) {
    for (j = 0; status == LM_OK && j < f->sections; j++) {
      status = check_range(fault, "twist_rad_per_Nmm", f->twist_rad_per_Nmm[i][j], -TWIST_MAX,
                           TWIST_MAX);
    }
  }
  return status;
}

lm_status lm_near_take_up(const lm_contact contacts[], int count, int far, int *touched,
                          const lm_foundation *foundation, const lm_real torque_Nm[], int torques,
                          lm_take_up states[], lm_rest *rest, lm_take_up_workspace *workspace,
                          lm_fault *fault) {
  lm_rest found;
  lm_status status;
  path p;
  int below = 0; /* torques < 0 */
  int above;     /* first torque > 0 */
  if (contacts == 0 || foundation == 0 || torque_Nm == 0 || states == 0 || workspace == 0) {
    return refuse(fault, LM_NULL, "contacts, foundation, torque_Nm, states, workspace");
  }
  status = check_range(fault, "count", LM_REAL(count), LM_REAL(1), LM_REAL(LM_CONTACTS_MAX));
  if (status == LM_OK && torques < 1) {
    status = refuse_capacity(fault, "torques", torques, 1);
  }
  if (status == LM_OK) {
    status = check_contacts(contacts, count, foundation, fault);
  }
  if (status == LM_OK) {
    status = check_torques(torque_Nm, torques, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  p.contacts = contacts;
  p.count = count;
  p.far = far;
  p.touched = 0;
  p.foundation = foundation;
  p.w = workspace;
  p.multiplicity = foundation->lobes == 1 ? LM_REAL(2) : LM_REAL(1);
  workspace->stage_count = 0;
  range_of_teeth(&p);
  status = check_foundation(&p, fault);
  if (status == LM_OK) {
    status = find_rest(&p, &found, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  p.middle_rad = found.middle_rad;
  watch_far(&p, workspace->force, found.middle_rad);
  keep_rest(&p);
  while (below < torques && torque_Nm[below] < LM_REAL(0)) {
    below++;
  }
  above = below;
  if (above < torques && torque_Nm[above] == LM_REAL(0)) {
    report_rest(&p, &states[above]);
    above++;
  }
  if (below > 0) {
    status = follow(&p, TURN_DOWN, torque_Nm, below - 1, 0, states, fault);
  }
  if (status == LM_OK && below > 0 && above < torques) {
    return_to_rest(&p);
  }
  if (status == LM_OK && above < torques) {
    status = follow(&p, TURN_UP, torque_Nm, above, torques - 1, states, fault);
  }
  if (status == LM_OK && rest != 0) {
    *rest = found;
  }
  *touched = p.touched;
  return status;
}

lm_status lm_coupled_take_up(const lm_contact contacts[], int count,
                             const lm_foundation *foundation, const lm_real torque_Nm[],
                             int torques, lm_take_up states[], lm_rest *rest,
                             lm_take_up_workspace *workspace, lm_fault *fault) {
  int touched;
  return lm_near_take_up(contacts, count, 0, &touched, foundation, torque_Nm, torques, states, rest,
                         workspace, fault);
}
