/** How far a build or a job is, in words, also in the title of the tab. */

const TITLE = document.title;

/** Format seconds: 34 s, 1 min 20 s, 12 h 3 min. */
export function duration(seconds) {
  const minutes = Math.floor(seconds / 60);
  if (!minutes) return `${Math.floor(seconds)} s`;
  if (minutes < 60) return `${minutes} min ${Math.floor(seconds % 60)} s`;
  return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

/** Whole per cent of the pixels that are cut. */
const share = ({ cut }, count) => Math.floor(100 * cut / Math.max(1, count));

/**
 * Describe the progress.
 * @param {{building_s: number?, job: object?}} progress - as the server sends it
 * @param {number} count - pixels to cut
 * @returns {string} empty if there is none
 */
export function describe({ building_s: building, job }, count) {
  if (building !== null) {
    return `Building for ${duration(building)}; the first time on a computer takes a minute or two.`;
  }
  if (!job) return "";
  const { busy, cut, elapsed_s: elapsed } = job;
  if (!busy) {
    const what = cut < count ? `Ended at ${share(job, count)} %` : "Milled";
    return `${what} after ${duration(elapsed)}.`;
  }
  // Pixels take different times, above all those that the tool must travel to.
  const left = cut ? `, about ${duration(elapsed * (count - cut) / cut)} left` : "";
  return `${share(job, count)} %, ${duration(elapsed)} elapsed${left}.`;
}

/** Describe the time of a job on the real board; empty if there is no job. */
export function describeReal({ job }, count) {
  if (!job) return "";
  const { busy, cut, real_s: real } = job;
  const total = busy && cut ? ` of about ${duration(real * count / cut)}` : "";
  return `On the real board: ${duration(real)}${total}.`;
}

/** Return the title of a tab, which is all that is seen of one behind others. */
export function title({ building_s: building, job }, count, state) {
  if (building !== null) return `Building – ${TITLE}`;
  if (state.stopped) return `Stopped – ${TITLE}`;
  if (job?.busy) return `${share(job, count)} % – ${TITLE}`;
  return state.done ? `Done – ${TITLE}` : TITLE;
}
