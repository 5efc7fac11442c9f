/* Surfaces on a hinge: each has one degree of freedom, a weight, a spring, a damper, stops and a motor.

   Between impulses the angle follows

       I angle'' = -spring (angle - rest) - damper angle' + moment of the weight + torque by hand,

   solved as a power series in time, which is exact to rounding, as steps are short compared with all its time scales.
   Lasting contacts, stops and the motor act by impulses once a step, and are solved together. An impact ends the step, so
   that all paths begin anew together with the hinge's. */

#include "core.h"

/* Longest step, as a share of the shortest time scale. */
#define SHARE 0.5
/* rad; a hinge this near to a stop lies on it. */
#define AGAINST 1e-7
/* Share of the step: a stop that is met later than that is met at its end. */
#define LATE 1e-6
/* Greatest number of sweeps over stops and motor of hinges that nothing touches. */
#define ALONE 50

static Mover *hinge_of(const Contact *c) { return W.movers + c->hung - 1; }

static int is_hinge(const Mover *m) { return m->inertia > 0; }

/* Whether a stop acts on it in this step. */
static int is_stopped(const Mover *m) { return m->solved && (m->impulse[0] != 0 || m->impulse[1] != 0); }

/* Angular impulse that a contact's impulses take from its hinge, N m s. */
static double moment_of(const Contact *c, const double *J) {
    return J[0] * c->lever[0] + J[1] * c->lever[1] + J[2] * c->lever[2];
}

/* Moment of the weight, N m, at an angle of 0 and at a quarter turn. */
static void weigh(const Mover *m, double *now, double *ahead) {
    *now = m->moment[0] * W.gy - m->moment[1] * W.gx;
    *ahead = -m->moment[0] * W.gx - m->moment[1] * W.gy;
}

/* Set the path from `since` on. */
static void lay_path(Mover *m) {
    double s[TERMS], c[TERMS], now, ahead, *a = m->path;
    weigh(m, &now, &ahead);
    a[0] = m->angle;
    a[1] = m->rate;
    s[0] = sin(m->angle);
    c[0] = cos(m->angle);
    for (int k = 0; k + 2 < TERMS; k++) {
        double moment = now * c[k] + ahead * s[k] - m->spring * a[k] - m->damper * (k + 1) * a[k + 1];
        if (k == 0) moment += m->spring * m->rest + m->torque;
        a[k + 2] = moment / (m->inertia * (k + 1) * (k + 2));
        s[k + 1] = c[k + 1] = 0;
        for (int j = 0; j <= k; j++) {
            s[k + 1] += (j + 1) * a[j + 1] * c[k - j] / (k + 1);
            c[k + 1] -= (j + 1) * a[j + 1] * s[k - j] / (k + 1);
        }
    }
    m->t = NAN;
}

/* Angle, angular velocity and angular acceleration at a time h after the beginning of the path. */
static void follow_path(const Mover *m, double h, double *angle, double *rate, double *change) {
    const double *a = m->path;
    *angle = *rate = *change = 0;
    for (int k = TERMS - 1; k >= 0; k--) {
        *angle = *angle * h + a[k];
        if (k > 0) *rate = *rate * h + k * a[k];
        if (k > 1) *change = *change * h + k * (k - 1) * a[k];
    }
}

/* Change of the angle at a time h after a change of the angular velocity, per that change, s. It is less than h, since
   damper and spring act meanwhile. */
static double yields(const Mover *m, double h) {
    double before = 0, term = 1, power = 1, sum = 0;
    for (int k = 1; k < TERMS; k++) {
        double next = -(m->damper * k * term + m->spring * before) / (m->inertia * k * (k + 1));
        power *= h;
        sum += term * power;
        before = term;
        term = next;
    }
    return sum;
}

/* Set a hinge to where it is at t. */
void set_hinge(Mover *m, double t) {
    double angle;
    follow_path(m, t - m->since, &angle, &m->turn, &m->hastens);
    m->sine = sin(angle);
    m->cosine = cos(angle);
    for (int n = 0; n < 2; n++) {
        m->place[n] = m->pivot[n];
        m->velocity[n] = m->pull[n] = 0;
    }
    m->t = t;
}

/* Move a hinge along its path up to t, and begin a new path. Its damper takes the integral of damper rate^2. If a stop
   holds it in this step, its motion is a hop: what the damper takes of that, the stop has given and gets back. */
static void advance_hinge(Mover *m, double t) {
    double h = t - m->since, lost = 0, change, power;
    const double *a = m->path;
    if (!(h > 0)) return;
    for (int k = 1; k < TERMS && m->damper > 0; k++) {
        power = 1;
        for (int n = 1; n < k; n++) power *= h;
        for (int j = 1; j < TERMS; j++, power *= h) lost += k * a[k] * j * a[j] * power * h / (k + j - 1);
    }
    *(is_stopped(m) ? &m->stopped : &m->damped) += m->damper * lost;
    double was = m->angle;
    follow_path(m, h, &m->angle, &m->rate, &change);
    m->pushed += m->torque * (m->angle - was);
    m->since = t;
    lay_path(m);
}

static void note(const Mover *m, double t, double rate) {
    W.swing_work[3 * W.swing_count] = m->stopped;
    W.swing_work[3 * W.swing_count + 1] = m->damped;
    W.swing_work[3 * W.swing_count + 2] = m->pushed;
    W.swings[W.swing_count++] = (Swing){ t, m->angle, rate, m->surface, 0 };
}

/* Set a hinge to its written position, at rest. */
void prepare_hinge(Mover *m) {
    m->since = m->angle = m->rate = m->worked = m->stopped = m->damped = m->torque = m->pushed = 0;
    m->impulse[0] = m->impulse[1] = m->impulse[2] = 0;
    m->acted = -INFINITY;
    m->stirs = m->solved = m->struck = m->lies = 0;
    lay_path(m);
    note(m, 0, 0);
}

/* Longest step that the paths of all hinges allow, s. */
double hinge_step(double h) {
    for (const Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (!is_hinge(m)) continue;
        double weight = W.g * hypot(m->moment[0], m->moment[1]);
        weight += fabs(m->torque);
        double fast = MAX(sqrt((m->spring + weight) / m->inertia), MAX(m->damper / m->inertia, fabs(m->rate)));
        if (fast * h > SHARE) h = SHARE / fast;
    }
    return h;
}

/* Set bounds on speed and acceleration of surfaces on hinges in a step of length h, and boxes that contain what they
   sweep. */
void bound_hinges(double t, double h) {
    for (Surface *s = W.surfaces; s < W.surfaces + W.surface_count; s++) {
        if (s->mover < 0 || !is_hinge(W.movers + s->mover)) continue;
        const Mover *m = W.movers + s->mover;
        double rate = 0, change = 0, power = 1;
        for (int k = 1; k < TERMS; k++, power *= h) {
            rate += k * fabs(m->path[k]) * power;
            if (k + 1 < TERMS) change += k * (k + 1) * fabs(m->path[k + 1]) * power;
        }
        s->fastest = s->reach * rate;
        s->haste = s->reach * (change + rate * rate);
        W.fastest = MAX(W.fastest, s->fastest);
        W.haste = MAX(W.haste, s->haste);
        double more = s->fastest * h;
        move_to(s, t);
        box_around(s, more);
    }
}

/* Begin a step of length h at t: what stops and motors ask for. */
void begin_hinges(double t, double h) {
    double share = W.again;
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        double angle, rate, change;
        if (!is_hinge(m)) continue;
        advance_hinge(m, t);
        m->before = m->rate;
        m->drift = m->path[2] * h;
        /* The motor acts up to the middle of this step; the step before may have ended earlier than it was to. */
        m->most = t >= m->begins ? MAX(t + 0.5 * h - MAX(m->acted, m->begins), 0) * m->motor[1] : 0;
        if (t >= m->begins) m->acted = MAX(m->acted, t + 0.5 * h);
        follow_path(m, h, &angle, &rate, &change);
        for (int n = 0; n < 2; n++) {
            int touches = n ? m->angle >= m->stops[1] - AGAINST : m->angle <= m->stops[0] + AGAINST;
            /* If the step before ended early, it may be amid a hop. */
            touches |= m->impulse[n] != 0 || m->lies == n + 1;
            /* As with joints, a short step corrects only as small a share of what is beyond the stop. */
            double beyond = n ? MAX(m->angle - m->stops[n], 0) : MIN(m->angle - m->stops[n], 0);
            double least = m->stops[n] + beyond * (1 - MIN(h / W.usual, 1));
            m->need[n] = touches ? (least - angle) / yields(m, h) : n ? INFINITY : -INFINITY;
            m->impulse[n] *= touches ? share : 0;
        }
        m->impulse[2] = MIN(MAX(share * m->impulse[2], -m->most), m->most);
        m->lies = 0;
    }
}

/* Work of a hinge's angular impulse J after the share f of it has been given, J. */
static double work(const Mover *m, double J, double f) {
    return 0.5 * J * ((1 - f) * (1 - f) * m->before + (1 - f * f) * m->rate);
}

/* Book the work of motors, and the losses at stops, of their impulses after the share f of them; times `sign`. */
static void book_hinge(Mover *m, double f, double sign) {
    m->worked += sign * work(m, m->impulse[2], f);
    m->stopped -= sign * work(m, m->impulse[0] + m->impulse[1], f);
}

/* Let the stop on which a hinge lies take its angular velocity, without restitution. */
static void rest_on_stop(Mover *m) {
    m->stopped += 0.5 * m->inertia * square(m->rate);
    m->rate = 0;
}

/* Set a hinge to where it is at t, when it is struck: the step ends there. If a stop held it in this step, its motion is
   a hop: it lies on the stop, at rest. So it does if a step would not take it away from there: a hinge at rest on its stop
   has an angular velocity by rounding. */
void strike_hinge(int mover, double t) {
    Mover *m = W.movers + mover;
    double slow = AGAINST / W.usual;
    advance_hinge(m, t);
    if (m->solved) {
        note(m, t, m->rate);
        m->lies = m->impulse[0] != 0 ? 1 : m->impulse[1] != 0 ? 2 : 0;
    }
    if (!m->lies && m->angle <= m->stops[0] + AGAINST && m->rate <= slow) m->lies = 1;
    if (!m->lies && m->angle >= m->stops[1] - AGAINST && m->rate >= -slow) m->lies = 2;
    if (m->lies) {
        rest_on_stop(m);
        lay_path(m);
    }
    m->solved = 0;
    m->before = m->rate;
    W.step_end = MIN(W.step_end, t);
}

/* Set what stops ask for at an instant t within a step; motors have no time to act. */
void stop_hinges(double t) {
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (!is_hinge(m)) continue;
        strike_hinge((int)(m - W.movers), t);
        m->drift = m->most = 0;
        for (int n = 0; n < 3; n++) m->impulse[n] = 0;
        for (int n = 0; n < 2; n++) {
            int touches = n ? m->angle >= m->stops[1] - AGAINST : m->angle <= m->stops[0] + AGAINST;
            m->need[n] = touches || m->lies == n + 1 ? -m->rate : n ? INFINITY : -INFINITY;
        }
    }
}

/* Book the losses at stops at that instant, and begin new paths. */
void go_on(void) {
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (!is_hinge(m)) continue;
        book_hinge(m, 0, 1);
        lay_path(m);
    }
}

/* Sweep over stops and motors of all hinges; return the greatest change of an angular velocity, rad/s. */
static double turn_hinges(void) {
    double worst = 0;
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (!is_hinge(m)) continue;
        double was = m->rate, *J = m->impulse, given;
        if (m->most > 0) {
            given = J[2] + m->inertia * (m->motor[0] - m->rate - m->drift);
            given = MIN(MAX(given, -m->most), m->most) - J[2];
            J[2] += given;
            m->rate += given / m->inertia;
        }
        for (int n = 0; n < 2; n++) {
            if (fabs(m->need[n]) == INFINITY) continue;
            given = m->inertia * (m->need[n] - (m->rate - m->before));
            given = n ? MIN(J[1] + given, 0) - J[1] : MAX(J[0] + given, 0) - J[0];
            J[n] += given;
            m->rate += given / m->inertia;
        }
        worst = MAX(worst, fabs(m->rate - was));
    }
    return worst;
}

/* Give hinges the impulses with which the sweeps begin. */
static void start_hinges(void) {
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (!is_hinge(m)) continue;
        m->rate = m->before;
        for (int n = 0; n < 3; n++) m->rate += m->impulse[n] / m->inertia;
    }
}

/* What hinges add to the left side of the energy law of a solve, see `check_solve`. */
double gained_by_hinges(void) {
    double gained = 0;
    for (const Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (!is_hinge(m)) continue;
        const double *J = m->impulse;
        gained += m->inertia * (m->rate - m->before) * m->rate - J[2] * (m->motor[0] - m->drift);
        for (int n = 0; n < 2; n++)
            if (J[n] != 0) gained -= J[n] * (m->before + m->need[n]);
    }
    return gained;
}

/* Solve stops and motors if no contact acts on hinges; book them, and begin the paths of the step. */
void leave_hinges(double t) {
    for (int n = 0; n < ALONE && !W.swings_too; n++) {
        if (n == 0) start_hinges();
        if (turn_hinges() == 0) break;
    }
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (!is_hinge(m)) continue;
        /* What is told is the state after the share of the impulses that belongs to the step before. */
        book_hinge(m, 0, 1);
        book_hinge(m, W.before, -1);
        note(m, t, m->before + W.before * (m->rate - m->before));
        book_hinge(m, W.before, 1);
        m->solved = 1;
        m->struck = 0;
        lay_path(m);
    }
}

/* The time at which the first hinge meets a stop in the step that begins at t, else the end of the step, s. The step ends
   there, so that impacts on stops are at ends of steps. */
double meet_stops(double t, double end) {
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (!is_hinge(m)) continue;
        for (int n = 0; n < 2; n++) {
            double side = n ? 1 : -1, stop = m->stops[n], h = end - t, angle, rate, change;
            follow_path(m, h, &angle, &rate, &change);
            if (fabs(stop) == INFINITY || side * (angle - stop) <= 0) continue;
            if (side * (m->angle - stop) >= -AGAINST || m->impulse[n] != 0) continue;
            double low = 0, high = h;
            for (int k = 0; k < 200 && high > low; k++) {
                double next = side * rate > 0 ? h - (angle - stop) / rate : low;
                if (!(next > low && next < high)) next = 0.5 * (low + high);
                if (next == low || next == high || next == h) break;
                follow_path(m, h = next, &angle, &rate, &change);
                if (side * (angle - stop) < 0) low = h;
                else high = h;
            }
            if (high > (1 - LATE) * (end - t)) high = end - t;
            for (Mover *o = W.movers; t + high < end && o < m; o++) o->struck = 0;
            m->struck = n + 1;
            end = high < end - t ? t + high : end;
        }
    }
    return end;
}

/* End a step at t: resolve impacts on stops, which have no restitution. */
void end_hinges(double t) {
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (!is_hinge(m)) continue;
        double side = m->struck == 2 ? 1 : -1;
        advance_hinge(m, t);
        m->solved = 0;
        if (!m->struck || side * m->rate <= 0) continue;
        if (side * (m->angle - m->stops[m->struck - 1]) < -AGAINST) continue;
        note(m, t, m->rate);
        m->stopped += 0.5 * m->inertia * square(m->rate);
        m->rate = 0;
        lay_path(m);
    }
}

/* End the run at t: the last solve counts for the share of its impulses that belongs to the step before. */
void finish_hinges(double t) {
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (!is_hinge(m)) continue;
        advance_hinge(m, t);
        if (m->solved) {
            book_hinge(m, W.before, -1);
            m->rate = m->before + W.before * (m->rate - m->before);
        }
        m->solved = 0;
        note(m, t, m->rate);
    }
}

/* Set the levers of a contact with a hinge, and its masses with the inertia of the hinge. */
void hang_on(Contact *c, const Mover *m, const Disk *d) {
    double turn = 1 / m->inertia, deep = d->radius + c->gap;
    double x = d->x - deep * c->nx - m->place[0], y = d->y - deep * c->ny - m->place[1];
    c->hung = (int)(m - W.movers) + 1;
    c->lever[0] = x * c->ny - y * c->nx;
    c->lever[1] = -(x * c->nx + y * c->ny);
    c->lever[2] = 1;
    c->turning = m->turn;
    for (int n = 0; n < 3; n++) {
        double light = c->mass[n] > 0 ? 1 / c->mass[n] : 0;
        c->mass[n] = 1 / (light + square(c->lever[n]) * turn);
    }
}

/* Subtract what a hinge has changed of the relative velocities since the contact was described. */
void swing_away(const Contact *c, int earlier, double *out) {
    const Mover *m = hinge_of(c);
    double more = (earlier ? m->before : m->rate) - c->turning;
    for (int n = 0; n < 3; n++) out[n] -= c->lever[n] * more;
}

/* Change of the normal velocity by the hinge in this step, m/s. */
double swung_open(const Contact *c) {
    const Mover *m = hinge_of(c);
    return -c->lever[0] * (m->rate - m->before);
}

/* Give the hinge of a contact the opposite of an impulse. */
void push_hinge(const Contact *c, const double *J) {
    Mover *m = hinge_of(c);
    m->rate -= moment_of(c, J) / m->inertia;
}

/* Work, by the change of the hinge's angular velocity since the contact was described, of the contact's impulses after
   the share f of them, J. */
double swung(const Contact *c, double f) {
    const Mover *m = hinge_of(c);
    double along = moment_of(c, c->impulse);
    return work(m, along, f) - (1 - f) * along * c->turning;
}

/* Work of a contact's impulses by the angular velocity of the hinge that isn't part of the energy law of a solve, J. */
double hinge_share(const Contact *c) { return moment_of(c, c->impulse) * c->turning; }

/* Turn a hinge, given by the owner of its surfaces, with a torque until the next call. */
EXPORT void turn_hinge(int owner, double torque) {
    for (Mover *m = W.movers; m < W.movers + W.mover_count; m++) {
        if (m->surface != owner || !is_hinge(m)) continue;
        advance_hinge(m, W.t);
        m->torque = torque;
        lay_path(m);
    }
}

/* Begin a path after an impact has changed a hinge's angular velocity. If it turns against the stop on which it lies, the
   stop takes that. */
void leave_struck(int mover) {
    Mover *m = W.movers + mover;
    double off = m->lies == 2 ? -m->rate : m->rate;
    if (m->lies && off < 0) rest_on_stop(m);
    else if (off > 0) m->lies = 0;
    lay_path(m);
}

/* If an impact presses a hinge against the stop on which it lies, the hinge stands like a fixed surface. Return whether
   it does, for the impulses that are in the list. Then its levers are 0. */
int hold_hinge(Contact *list, int count) {
    Mover *m = list->hung ? hinge_of(list) : 0;
    double moment = 0;
    for (int n = 0; n < count && m && m->lies; n++) moment -= moment_of(list + n, list[n].impulse);
    if (!(m && m->lies == 2 ? moment > 0 : moment < 0)) return 0;
    for (int n = 0; n < count; n++) {
        Contact *c = list + n;
        const Disk *d = W.disks + c->i;
        for (int k = 0; k < 3; k++) c->lever[k] = 0;
        c->mass[0] = d->mass;
        c->mass[1] = 1 / (d->inv_mass + square(d->radius) * d->inv_inertia);
        c->mass[2] = d->inertia;
    }
    m->rate = 0;
    return 1;
}
