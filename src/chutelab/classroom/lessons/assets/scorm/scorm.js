// Between a lesson's page, in the frame, and a learning platform's SCORM 1.2 API (Run-Time
// Environment 3.2 and 3.4). The page tells "ready" and "progress" and is told "begin"; without a
// platform it is told nothing, and works by itself.
"use strict";

(() => {
  /**
   * @typedef {Record<string, (...values: string[]) => unknown>} Api
   * @typedef {{score: number, status: string, suspend_data: string,
   *   verdicts?: Record<string, string>,
   *   result: {answers?: Record<string, number>, tries?: Record<string, number>}}} Progress
   */

  const SOON = 2000; // ms from the last change to a commit
  const LONGEST_NAME = 200; // characters, as the page has it

  /** The API in a window or above it. @param {any} first @returns {Api | null} */
  function found(first) {
    let above = first;
    for (let steps = 0; above && steps < 20; steps += 1) {
      try {
        if (above.API) return above.API;
      } catch {
        return null; // a window of somebody else
      }
      if (above.parent === above) return null;
      above = above.parent;
    }
    return null;
  }

  const api = found(window) ?? found(window.opener) ?? found(window.top?.opener);

  /** @param {string} name @param {string[]} values */
  function call(name, ...values) {
    try {
      return String(api?.[name](...values));
    } catch {
      return "";
    }
  }

  const get = (/** @type {string} */ key) => call("LMSGetValue", key);
  const set = (/** @type {string} */ key, /** @type {string | number} */ value) =>
    call("LMSSetValue", key, String(value)) === "true";

  /** A time of day or a duration. @param {number[]} parts hours, minutes, seconds */
  const clock = (...parts) => parts.map((part) => String(part).padStart(2, "0")).join(":");

  const began = Date.now();
  let isOpen = api !== null && call("LMSInitialize", "") === "true";
  /** How often each question was tried; null until the page has told where it goes on.
   * @type {Record<string, number> | null} */
  let tried = null;
  let later = 0;

  function warn() {
    document.getElementById("alone")?.removeAttribute("hidden");
  }

  function commit() {
    clearTimeout(later);
    if (isOpen) call("LMSCommit", "");
  }

  /** @param {Window} page */
  function begin(page) {
    const name = get("cmi.core.student_name").trim() || get("cmi.core.student_id").trim();
    if (["not attempted", "unknown", ""].includes(get("cmi.core.lesson_status"))) {
      set("cmi.core.lesson_status", "incomplete");
    }
    tried = null;
    const student = name.slice(0, LONGEST_NAME), suspended = get("cmi.suspend_data");
    page.postMessage({ chutelab: "begin", student, suspend_data: suspended }, "*");
  }

  /** Tell of an answer, under the next number of those that the platform has.
   * @param {string} question @param {number} answer @param {boolean} isRight */
  function tell(question, answer, isRight) {
    const next = get("cmi.interactions._count"), at = `cmi.interactions.${next}`;
    if (!/^\d+$/.test(next)) return; // a platform that keeps none
    const now = new Date();
    set(`${at}.id`, `question-${question}`);
    set(`${at}.type`, "numeric");
    set(`${at}.time`, clock(now.getHours(), now.getMinutes(), now.getSeconds()));
    set(`${at}.student_response`, answer);
    set(`${at}.result`, isRight ? "correct" : "wrong");
  }

  /** @param {Progress} progress */
  function keep({ score, status, suspend_data: suspended, verdicts = {}, result }) {
    const { answers = {}, tries = {} } = result, before = tried;
    tried = tries;
    if (!before) return; // where it goes on, which the platform has
    set("cmi.core.score.min", 0);
    set("cmi.core.score.max", 100);
    const isKept = [
      set("cmi.core.score.raw", score), set("cmi.core.lesson_status", status),
      set("cmi.suspend_data", suspended),
    ].every(Boolean);
    if (!isKept) warn();
    for (const [question, verdict] of Object.entries(verdicts)) {
      if (tries[question] !== before[question] && ["right", "mistake", "off"].includes(verdict)) {
        tell(question, answers[question], verdict === "right");
      }
    }
    clearTimeout(later);
    later = window.setTimeout(commit, SOON);
  }

  function leave() {
    if (!isOpen) return;
    const seconds = Math.floor((Date.now() - began) / 1000), minutes = Math.floor(seconds / 60);
    set("cmi.core.session_time", clock(Math.floor(minutes / 60), minutes % 60, seconds % 60));
    set("cmi.core.exit", "suspend"); // what was done is there again next time
    commit();
    call("LMSFinish", "");
    isOpen = false;
  }

  addEventListener("message", ({ data, source }) => {
    const page = document.querySelector("iframe")?.contentWindow;
    if (!isOpen || !page || source !== page) return;
    if (data?.chutelab === "ready") begin(page);
    if (data?.chutelab === "progress") keep(data);
  });
  // A phone may end a page that is out of sight without another word.
  addEventListener("visibilitychange", () => document.hidden && commit());
  addEventListener("pagehide", leave);
  // A page that comes back from the browser's memory has left already.
  addEventListener("pageshow", ({ persisted }) => persisted && location.reload());
  addEventListener("DOMContentLoaded", () => isOpen || warn());
})();
