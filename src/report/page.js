"use strict";
// Chooses what the charts of the history are drawn over, and which snapshot the bodies show.
const over = document.getElementById("over");
if (over) {
  const choose = () => {
    for (const chart of document.querySelectorAll(".choice")) {
      chart.hidden = chart.dataset.over !== over.value;
    }
  };
  over.addEventListener("change", choose);
  choose();
}
const slider = document.getElementById("frame");
if (slider) {
  const frames = JSON.parse(document.getElementById("frames").textContent);
  const time = document.getElementById("time");
  const show = () => {
    const number = Number(slider.value);
    time.textContent = "time " + Number(frames.times[number].toPrecision(6));
    for (const body of document.querySelectorAll("figure.body")) {
      body.querySelector("image.points").setAttribute("href", frames.fields[body.dataset.field][number]);
    }
  };
  slider.addEventListener("input", show);
  show();
}
