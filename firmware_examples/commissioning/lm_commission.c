#include "lm_commission.h"

#include <string.h>

/* Of the bound: a brake has less play, and lets the motor fall further. */
#define BRAKE_SHARE 0.25f

/* The first angle is the setpoint: the loop yields to the load, and must not do so again. */
static float report(const lm_commission *c, const lm_axis *a, float motor_rad, float output_rad) {
  return a->output_loop ? output_rad
         : c->begun     ? motor_rad / c->run.set.ratio - c->out.correction.correction_rad
                        : a->setpoint_rad;
}

/* The loop does not do what it was told: off at once, a brake of the host catches the load. */
static int is_parted(commissioning_finding finding) {
  return finding == COMMISSIONING_FOLLOW || finding == COMMISSIONING_STUCK ||
         finding == COMMISSIONING_FEED_SCALE;
}

/* Once the loop is off, a motor that moves is not held by the brake. */
static void judge_brake(lm_commission *c, lm_axis *a, float motor_rad) {
  const float moved_rad = lm_follow_size(motor_rad / c->run.set.ratio - c->stopped_rad);
  c->stopped_s = a->state == LM_AXIS_OPEN ? c->stopped_s + a->follow.period_s : 0;
  if (moved_rad > BRAKE_SHARE * c->run.set.follow_bound_rad) {
    c->out.finding = COMMISSIONING_BRAKE;
  } else if (c->stopped_s > a->follow.stand_s) {
    c->out.finding = COMMISSIONING_NO_FAULT;
    a->commissioned = 1;
  } else {
    /* it may still close */
  }
}

commissioning_finding lm_commission_start(lm_commission *c, lm_axis *a, lm_drive *d,
                                          const commissioning_settings *settings) {
  commissioning_finding finding;
  commissioning_settings suggested;
  if (a->state != LM_AXIS_OPEN || d->runs) {
    c->out.finding = c->on ? c->out.finding : COMMISSIONING_ABORTED;
    return COMMISSIONING_ABORTED;
  }
  memset(c, 0, sizeof *c);
  suggested = commissioning_suggest(a->compensator.parameters, a->ratio);
  suggested.output_loop = a->output_loop;
  finding = commissioning_start(&c->run, settings ? settings : &suggested);
  c->on = finding == COMMISSIONING_RUNNING;
  c->out.finding = finding;
  if (c->on) {
    d->ended = LM_AXIS_READY;
    (void)lm_axis_guide(a, LM_UNKNOWN, 0);
  }
  return finding;
}

void lm_commission_step(lm_commission *c, lm_axis *a, lm_drive *d, const lm_conditions *at,
                        float motor_rad, float output_rad) {
  commissioning_input in = {
      0, 0, 0, 0, LM_UNKNOWN, LM_UNKNOWN, LM_UNKNOWN, LM_UNKNOWN, LM_CONDITIONS_UNKNOWN};
  int guides;
  if (c->on && c->stops && !c->out.finding) {
    d->armed = 0;
    judge_brake(c, a, motor_rad);
    c->on = !c->out.finding;
    return;
  }
  if (c->on && !c->out.finding && d->ended == LM_AXIS_WAITS_PARTED) {
    commissioning_abort(&c->run);
    c->out.finding = COMMISSIONING_FOLLOW;
  }
  c->waited_s = d->runs ? 0 : c->waited_s + a->follow.period_s;
  if (a->state < LM_AXIS_PAUSED && (c->out.finding || c->waited_s > LM_DRIVE_ENABLING_S)) {
    c->out.finding = c->on && !c->out.finding ? COMMISSIONING_ABORTED : c->out.finding;
    c->on = 0;
  }
  if (!c->on) {
    return;
  }
  guides = lm_axis_guide(a, LM_UNKNOWN, 0);
  if (!(guides && d->follows) && c->begun && !c->out.finding) {
    commissioning_abort(&c->run);
    c->out.finding = COMMISSIONING_ABORTED;
  }
  if (c->out.finding) {
    d->armed = 0;
  }
  if (!guides || c->out.finding) { /* the setpoint stays */
    return;
  }
  in.elapsed_s = at->elapsed_s;
  in.input_angle_rad = motor_rad;
  in.output_angle_rad = output_rad;
  in.reported_rad = report(c, a, motor_rad, output_rad);
  in.sensed_Nm = a->source == LM_AXIS_COMMAND ? LM_UNKNOWN : a->sensed_Nm;
  in.motor_rad_s = a->source == LM_AXIS_CURRENT ? a->motor_rad_s : LM_UNKNOWN;
  in.commanded_Nm = a->command_Nm;
  in.conditions = *at;
  if (a->source == LM_AXIS_CURRENT && !c->begun && a->bound_Nm > c->run.set.friction_Nm) {
    c->run.set.friction_Nm = a->bound_Nm;
  }
  c->begun = 1;
  c->out = commissioning_step(&c->run, &in);
  a->commissioned = 0;
  if (c->out.finding == COMMISSIONING_NO_FAULT) { /* once the brake has closed */
    c->out.finding = COMMISSIONING_RUNNING;
    c->stops = 1;
    c->stopped_rad = motor_rad / c->run.set.ratio;
    d->armed = 0;
  }
  if (c->out.stop && is_parted(c->out.finding)) {
    lm_drive_part(d, a);
  }
  (void)lm_axis_guide(a, c->out.command_rad, &c->out.correction);
  a->guide_Nm = c->out.feed_Nm;
  a->guide_rad_s = c->out.velocity_rad_s;
}
