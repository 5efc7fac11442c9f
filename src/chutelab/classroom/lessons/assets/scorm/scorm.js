// Between a lesson's page, in the frame, and a learning platform's SCORM 1.2 API (Run-Time
// Environment 3.2 and 3.4). The page tells "ready" and "progress" and is told "begin"; without a
// platform it is told nothing, and works by itself.
"use strict";

(() => {
  const SOON = 2000; // ms from the last change to a commit

  // In a window above this one, or above the one that opened this one.
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

  function call(name, ...values) {
    try {
      return String(api[name](...values));
    } catch {
      return "";
    }
  }

  const get = (key) => call("LMSGetValue", key);
  const set = (key, value) => call("LMSSetValue", key, String(value)) === "true";

  // hours:minutes:seconds, as CMITime and CMITimespan have it
  function clock(hours, minutes, seconds) {
    const two = (number) => String(number).padStart(2, "0");
    return `${two(hours)}:${two(minutes)}:${two(seconds)}`;
  }

  const began = Date.now();
  let open = Boolean(api) && call("LMSInitialize", "") === "true";
  let answered = null; // tries by question, from the first progress on
  let later = 0;

  function warn() {
    document.getElementById("alone").hidden = false;
  }

  function commit() {
    clearTimeout(later);
    if (open) call("LMSCommit", "");
  }

  function begin(page) {
    const student = get("cmi.core.student_name").trim() || get("cmi.core.student_id").trim();
    if (["not attempted", "unknown", ""].includes(get("cmi.core.lesson_status"))) {
      set("cmi.core.lesson_status", "incomplete");
    }
    const suspended = get("cmi.suspend_data");
    page.postMessage({ chutelab: "begin", student, suspend_data: suspended }, "*");
  }

  // Each answer that was checked since the last time, the last of each question.
  function tell({ verdicts = {}, result }) {
    const { answers = {}, tries = {} } = result;
    const fresh = Object.keys(verdicts).filter((n) => answered && tries[n] !== answered[n]);
    answered = { ...tries };
    for (const number of fresh) {
      const next = Number(get("cmi.interactions._count"));
      if (!Number.isInteger(next)) return; // a platform that keeps none
      const at = `cmi.interactions.${next}`;
      const now = new Date();
      set(`${at}.id`, `question-${number}`);
      set(`${at}.type`, "numeric");
      set(`${at}.time`, clock(now.getHours(), now.getMinutes(), now.getSeconds()));
      if (number in answers) set(`${at}.student_response`, answers[number]);
      set(`${at}.result`, verdicts[number] === "right" ? "correct" : "wrong");
    }
  }

  function keep(progress) {
    set("cmi.core.score.min", 0);
    set("cmi.core.score.max", 100);
    const scored = set("cmi.core.score.raw", progress.score);
    const stated = set("cmi.core.lesson_status", progress.status);
    set("cmi.suspend_data", progress.suspend_data);
    if (!scored || !stated) warn();
    tell(progress);
    clearTimeout(later);
    later = setTimeout(commit, SOON);
  }

  function leave() {
    if (!open) return;
    const seconds = Math.floor((Date.now() - began) / 1000);
    const minutes = Math.floor(seconds / 60);
    set("cmi.core.session_time", clock(Math.floor(minutes / 60), minutes % 60, seconds % 60));
    set("cmi.core.exit", "suspend"); // what was done is there again next time
    commit();
    call("LMSFinish", "");
    open = false;
  }

  addEventListener("message", ({ data, source }) => {
    const page = document.querySelector("iframe")?.contentWindow;
    if (!open || !source || source !== page) return;
    if (data?.chutelab === "ready") begin(page);
    if (data?.chutelab === "progress") keep(data);
  });
  // A phone may end a page that is out of sight without another word.
  addEventListener("visibilitychange", () => document.hidden && commit());
  addEventListener("pagehide", leave);
  // A page that comes back from the browser's memory has left already.
  addEventListener("pageshow", ({ persisted }) => persisted && location.reload());
  addEventListener("DOMContentLoaded", () => open || warn());
})();
