#include "motion.h"

#include "sine.h"

#define ARM {18.0f, 0.8f}  /* against gravity */
#define TABLE {0.0f, 1.1f} /* about a vertical axis */
#define HALF_PI 1.57079633f

const scenario scenarios[] = {
    {"reversals",
     ARM,
     0,
     0,
     0,
     0,
     0,
     6,
     0,
     {{0.7f, 0.6f}, {0.9f, -0.5f}, {0.6f, 0.2f}, {0.5f, -0.2f}, {0.7f, 0.5f}, {0.8f, -0.1f}}},
    {"circle, lifting axis", ARM, 0, 0.35f, 3.5f, 2, 0, 0, 0, {{0, 0}}},
    {"circle, level axis", TABLE, 0, 0.35f, 3.5f, 2, 1, 0, 0, {{0, 0}}},
    {"gravity sweep", ARM, 0, 0, 0, 0, 0, 3, 0, {{1.2f, 1.4f}, {2.4f, -1.4f}, {1.2f, 0}}},
    {"small jogs",
     ARM,
     0,
     0,
     0,
     0,
     0,
     16,
     1,
     {{0.8f, 0.4f},
      {0.1f, 0.4f},
      {0.08f, 0.402f},
      {0.1f, 0.402f},
      {0.08f, 0.404f},
      {0.1f, 0.404f},
      {0.08f, 0.406f},
      {0.1f, 0.406f},
      {0.08f, 0.404f},
      {0.1f, 0.404f},
      {0.08f, 0.402f},
      {0.1f, 0.402f},
      {0.08f, 0.4f},
      {0.1f, 0.4f},
      {0.08f, 0.402f},
      {0.3f, 0.402f}}},
    {"stop and go",
     ARM,
     0,
     0,
     0,
     0,
     0,
     10,
     0,
     {{0.5f, 0.15f},
      {0.2f, 0.15f},
      {0.4f, 0.3f},
      {0.2f, 0.3f},
      {0.5f, 0.05f},
      {0.2f, 0.05f},
      {0.5f, -0.2f},
      {0.2f, -0.2f},
      {0.5f, 0.0f},
      {0.3f, 0.0f}}},
    {"hovering", ARM, 1.2e-4f, 0, 0, 0, 0, 3, 2, {{0.6f, 0.3f}, {0.8f, 0.02f}, {3.0f, 0.02f}}},
    {"hovering after a hard stop", ARM, 1.2e-4f, 0, 0, 0, 0, 1, 0, {{3.0f, 0}}},
};
const int scenario_count = (int)(sizeof scenarios / sizeof scenarios[0]);

/* The initial motion erases the previous load history. */
static const move prelude[] = {{0.35f, 0.5f}, {0.6f, -0.5f}, {0.45f, 0.0f}, {0.2f, 0.0f}};
#define PRELUDE_MOVES 4

/* 10 u^3 - 15 u^4 + 6 u^5 and its derivatives. */
static motion move_at(float from_rad, const move *to, float time_s) {
  motion at;
  float u = time_s / to->duration_s;
  float way = to->to_rad - from_rad;
  float rate = way / to->duration_s;
  at.angle_rad = from_rad + way * u * u * u * (10 + u * (6 * u - 15));
  at.velocity_rad_s = rate * 30 * u * u * (1 - u) * (1 - u);
  at.acceleration_rad_s2 = rate / to->duration_s * 60 * u * (1 - u) * (1 - 2 * u);
  return at;
}

static motion moves_at(const move *moves, int count, int32_t tick) {
  motion at;
  float from_rad = 0;
  int i;
  for (i = 0; i < count; ++i) {
    int32_t ticks = (int32_t)(moves[i].duration_s / TICK_S + 0.5f);
    if (tick < ticks) {
      return move_at(from_rad, &moves[i], (float)tick * TICK_S);
    }
    tick -= ticks;
    from_rad = moves[i].to_rad;
  }
  at.angle_rad = from_rad;
  at.velocity_rad_s = 0;
  at.acceleration_rad_s2 = 0;
  return at;
}

static int32_t moves_ticks(const move *moves, int count) {
  int32_t ticks = 0;
  int i;
  for (i = 0; i < count; ++i) {
    ticks += (int32_t)(moves[i].duration_s / TICK_S + 0.5f);
  }
  return ticks;
}

int32_t unscored_ticks(const scenario *what) {
  return moves_ticks(prelude, PRELUDE_MOVES) + moves_ticks(what->moves, what->approach);
}

int32_t scenario_ticks(const scenario *what) {
  return moves_ticks(prelude, PRELUDE_MOVES) + (what->circle_rad > 0
                                                    ? (int32_t)(what->circle_s / TICK_S)
                                                    : moves_ticks(what->moves, what->count));
}

/* Radius times sin(p), or times 1 - cos(p), with the phase p running smoothly from rest to rest. */
static motion circle_at(const scenario *what, int32_t tick) {
  motion at;
  move round;
  motion p;
  float sin_p;
  float cos_p;
  round.duration_s = what->circle_s;
  round.to_rad = 4 * HALF_PI * (float)what->circle_turns;
  p = move_at(0, &round, (float)tick * TICK_S);
  sin_p = what->circle_rad * sine(p.angle_rad);
  cos_p = what->circle_rad * sine(p.angle_rad + HALF_PI);
  if (what->cosine) {
    at.angle_rad = what->circle_rad - cos_p;
    at.velocity_rad_s = sin_p * p.velocity_rad_s;
    at.acceleration_rad_s2 =
        cos_p * p.velocity_rad_s * p.velocity_rad_s + sin_p * p.acceleration_rad_s2;
  } else {
    at.angle_rad = sin_p;
    at.velocity_rad_s = cos_p * p.velocity_rad_s;
    at.acceleration_rad_s2 =
        cos_p * p.acceleration_rad_s2 - sin_p * p.velocity_rad_s * p.velocity_rad_s;
  }
  return at;
}

/* Two slow waves with an irrational frequency ratio, so that the turning points vary. */
static void add_unrest(motion *at, float amplitude_rad, float time_s) {
  static const float rate_rad_s[2] = {9.1f, 23.7f};
  static const float share[2] = {0.7f, 0.3f};
  int i;
  for (i = 0; i < 2; ++i) {
    float wave = amplitude_rad * share[i] * sine(rate_rad_s[i] * time_s);
    float quarter = amplitude_rad * share[i] * sine(rate_rad_s[i] * time_s + HALF_PI);
    at->angle_rad += wave;
    at->velocity_rad_s += quarter * rate_rad_s[i];
    at->acceleration_rad_s2 -= wave * rate_rad_s[i] * rate_rad_s[i];
  }
}

motion scenario_at(const scenario *what, int32_t tick) {
  motion at;
  int32_t own = tick - moves_ticks(prelude, PRELUDE_MOVES);
  if (own < 0) {
    return moves_at(prelude, PRELUDE_MOVES, tick);
  }
  if (what->circle_rad > 0) {
    return circle_at(what, own);
  }
  at = moves_at(what->moves, what->count, own);
  if (what->hover_rad > 0) {
    add_unrest(&at, what->hover_rad, (float)own * TICK_S);
  }
  return at;
}
