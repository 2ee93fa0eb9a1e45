// Steps MuJoCo models of piles and prints how fast: mujoco_scenes DT REPEAT FINAL.csv NAME MODEL.xml [NAME MODEL.xml ...]
//
// Joint 0 is the striker (slide along x), then x, y and turn of every body.  The numeric fields of a model tell the
// striker's speed and travel, and for every body the decelerations of a slide and of a spin.  The table's friction is
// applied half before and half after every step: a free slide is an exact parabola.
#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static double cpu_s(void) {
  struct timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

static const double* numeric(const mjModel* m, const char* name) {
  int id = mj_name2id(m, mjOBJ_NUMERIC, name);
  if (id < 0) exit(3);
  return m->numeric_data + m->numeric_adr[id];
}

// The table slows every body down; whether anything still moves.
static int rub(const mjModel* m, mjData* d, const double* grip, double time) {
  int moving = 0;
  for (int b = 0, n = (m->nq - 1) / 3; b < n; b++) {
    double* v = d->qvel + 1 + 3 * b;
    double speed = hypot(v[0], v[1]), lost = grip[2 * b] * time, spin_lost = grip[2 * b + 1] * time;
    if (speed == 0 && v[2] == 0) continue;
    double left = speed > lost ? 1 - lost / speed : 0;
    v[0] *= left;
    v[1] *= left;
    v[2] = fabs(v[2]) > spin_lost ? v[2] - copysign(spin_lost, v[2]) : 0;
    moving |= left > 0 || v[2] != 0;
  }
  return moving;
}

static void settle(const mjModel* m, mjData* d, double dt, double offset) {
  const double *grip = numeric(m, "grip"), *strike = numeric(m, "strike");
  mj_resetData(m, d);
  for (int k = 2; k < m->nq; k += 3) d->qpos[k] = -offset;
  int lift_after = (int)round(strike[1] / strike[0] / dt);
  for (int step = 0; step < 5 / dt; step++) {
    d->qvel[0] = step < lift_after ? strike[0] : 0;
    if (step == lift_after) d->qpos[0] = -10;
    int moving = rub(m, d, grip, 0.5 * dt);
    if (step > lift_after && !moving) break;
    mj_step(m, d);
    rub(m, d, grip, 0.5 * dt);
  }
}

int main(int argc, char** argv) {
  double dt = atof(argv[1]), busy = 0;
  int repeat = atoi(argv[2]), rollouts = 0;
  FILE* csv = fopen(argv[3], "w");
  if (!csv) return 2;
  fprintf(csv, "scene,object,x_m,y_m,yaw_rad\n");
  for (int a = 4; a + 1 < argc; a += 2) {
    char error[500];
    mjModel* m = mj_loadXML(argv[a + 1], NULL, error, sizeof error);
    if (!m) { fprintf(stderr, "%s\n", error); return 2; }
    mjData* d = mj_makeData(m);
    settle(m, d, dt, 0);
    for (int b = 0, n = (m->nq - 1) / 3; b < n; b++) {
      const double *q = d->qpos + 1 + 3 * b, *p = m->body_pos + 3 * (2 + b), *r = m->body_quat + 4 * (2 + b);
      double yaw = 2 * atan2(r[3], r[0]);
      fprintf(csv, "%s,%d,%.9f,%.9f,%.9f\n", argv[a], b, p[0] + q[0], p[1] + q[1], yaw + q[2]);
    }
    double start = cpu_s();
    for (int k = 0; k < repeat; k++, rollouts++) settle(m, d, dt, 1e-6 * (2 * fmod(k * 0.6180339887, 1) - 1));
    busy += cpu_s() - start;
    mj_deleteData(d);
    mj_deleteModel(m);
  }
  fclose(csv);
  printf("scenes=%d rollouts_per_cpu_s=%.3f\n", (argc - 4) / 2, rollouts / busy);
  return 0;
}
