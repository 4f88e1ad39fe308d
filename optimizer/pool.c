#include "pool.h"

#include <stdlib.h>
#include <string.h>

#include "platform.h"
#include "stop.h"
#include "workspace.h"

struct lm_pool {
  int workers;
  lm_workspace *workspace[LM_WORKERS_MAX];
  lm_known_results known;
  lm_lock *lock;
};

/* One run over a batch, shared by the threads. */
typedef struct run {
  const lm_problem *problem;
  const lm_task *tasks;
  int count;
  int next; /* first task not taken */
  int failed;
  lm_answer_sink sink;
  void *context;
  int (*skip)(void *context, int id);
  const volatile int *stop;
  lm_lock *lock;
} run;

typedef struct worker {
  run *shared;
  lm_workspace *workspace;
} worker;

static int is_stopped(const run *r) {
  return r->failed || lm_is_stopped(r->stop);
}

/* The next task to do, copied while the lock is held: the last answer may end the batch. */
static int take_task(run *r, lm_task *task) {
  int taken = 0;
  lm_acquire(r->lock);
  while (!taken && r->next < r->count && !is_stopped(r)) {
    *task = r->tasks[r->next++];
    taken = r->skip == NULL || !r->skip(r->context, task->id);
  }
  lm_release(r->lock);
  return taken;
}

static void work(void *data) {
  worker *w = (worker *)data;
  run *r = w->shared;
  lm_answer *answer = (lm_answer *)malloc(sizeof *answer);
  lm_task task;
  while (answer != NULL && take_task(r, &task)) {
    const lm_status status = lm_run_task(r->problem, &task, answer, w->workspace, r->stop);
    lm_acquire(r->lock);
    if (status == LM_OK) {
      r->sink(r->context, answer);
    } else {
      r->failed = 1;
    }
    lm_release(r->lock);
  }
  if (answer == NULL) {
    lm_acquire(r->lock);
    r->failed = 1;
    lm_release(r->lock);
  }
  free(answer);
}

lm_pool *lm_open_pool(int workers) {
  lm_pool *pool = (lm_pool *)calloc(1, sizeof *pool);
  int i;
  if (pool == NULL) {
    return NULL;
  }
  if (workers == 0) {
    const int cores = lm_count_cores();
    workers = cores > LM_WORKERS_MAX ? LM_WORKERS_MAX : cores;
  }
  pool->workers = workers;
  if (pool->workers < 1 || pool->workers > LM_WORKERS_MAX) {
    free(pool);
    return NULL;
  }
  pool->lock = lm_create_lock();
  if (!lm_open_known_results(&pool->known) || pool->lock == NULL) {
    lm_close_pool(pool);
    return NULL;
  }
  for (i = 0; i < pool->workers; i++) {
    pool->workspace[i] = lm_create_workspace();
    if (pool->workspace[i] == NULL) {
      lm_close_pool(pool);
      return NULL;
    }
    pool->workspace[i]->known = pool->known;
  }
  return pool;
}

void lm_close_pool(lm_pool *pool) {
  int i;
  if (pool != NULL) {
    for (i = 0; i < pool->workers; i++) {
      lm_free_workspace(pool->workspace[i]);
    }
    lm_close_known_results(&pool->known);
    lm_free_lock(pool->lock);
    free(pool);
  }
}

/* One thread for each worker, at most `count`. The calling thread works too, alone if no other can be
 * started. data[]: one element of a size for each. */
static void in_threads(const lm_pool *pool, int count, void (*function)(void *), void *data,
                       size_t size) {
  lm_thread *thread[LM_WORKERS_MAX];
  int started = 0;
  int i;
  for (i = 1; i < pool->workers && i < count; i++) {
    thread[started] = lm_start_thread(function, (char *)data + (size_t)i * size);
    started += thread[started] != NULL;
  }
  function(data);
  for (i = 0; i < started; i++) {
    lm_join_thread(thread[i]);
  }
}

lm_status lm_run_tasks(lm_pool *pool, const lm_problem *problem, const lm_task tasks[], int count,
                       int (*skip)(void *context, int id), lm_answer_sink sink, void *context,
                       const volatile int *stop) {
  run r;
  worker w[LM_WORKERS_MAX];
  int i;
  memset(&r, 0, sizeof r);
  r.problem = problem;
  r.tasks = tasks;
  r.count = count;
  r.skip = skip;
  r.sink = sink;
  r.context = context;
  r.stop = stop;
  r.lock = pool->lock;
  for (i = 0; i < pool->workers; i++) {
    w[i].shared = &r;
    w[i].workspace = pool->workspace[i];
  }
  in_threads(pool, count, work, w, sizeof w[0]);
  if (lm_is_stopped(stop)) {
    return LM_NOT_CONVERGED;
  }
  return r.failed ? LM_TOO_SMALL : LM_OK;
}

/* Designs to be measured, shared by the threads. */
typedef struct measuring {
  const lm_problem *problem;
  lm_measured *measured;
  int count;
  int next; /* first design not taken */
  lm_lock *lock;
} measuring;

typedef struct measurer {
  measuring *shared;
  lm_workspace *workspace;
} measurer;

static lm_measured *take_design(measuring *m) {
  lm_measured *taken;
  lm_acquire(m->lock);
  taken = m->next < m->count ? &m->measured[m->next++] : NULL;
  lm_release(m->lock);
  return taken;
}

static void measure(void *data) {
  measurer *m = (measurer *)data;
  lm_measured *taken;
  while ((taken = take_design(m->shared)) != NULL) {
    lm_measure_design(m->shared->problem, taken, m->workspace);
  }
}

void lm_measure_designs(lm_pool *pool, const lm_problem *problem, lm_measured measured[],
                        int count) {
  measuring shared;
  measurer m[LM_WORKERS_MAX];
  int i;
  shared.problem = problem;
  shared.measured = measured;
  shared.count = count;
  shared.next = 0;
  shared.lock = pool->lock;
  for (i = 0; i < pool->workers; i++) {
    m[i].shared = &shared;
    m[i].workspace = pool->workspace[i];
  }
  in_threads(pool, count, measure, m, sizeof m[0]);
}
