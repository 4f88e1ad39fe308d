// Draws the plots of a report when they come into view, and all of them before it is printed.
(() => {
  let unpacked;
  const unpack = async () => {
    const packed = document.getElementById('plotly-packed').textContent;
    const bytes = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
    const script = document.createElement('script');
    script.textContent = await new Response(stream).text();
    document.head.append(script);
  };
  const draw = async (place) => {
    if (place.dataset.drawn) return;
    place.dataset.drawn = 'yes';
    await (unpacked ??= unpack());
    const figure = JSON.parse(document.getElementById(`${place.id}-data`).textContent);
    await Plotly.newPlot(place, figure.data, figure.layout, figure.config);
  };
  const places = document.querySelectorAll('.chart');
  const watch = new IntersectionObserver(
    (seen) => seen.filter((one) => one.isIntersecting).forEach((one) => draw(one.target)),
    {rootMargin: '300px'},
  );
  places.forEach((place) => watch.observe(place));
  addEventListener('beforeprint', () => places.forEach(draw));
  const cells = (trace) =>
    Array.from(trace.y, (y, i) => [JSON.stringify(trace.name), trace.x[i], y].join(','));
  document.querySelectorAll('[data-csv]').forEach((button) =>
    button.addEventListener('click', async () => {
      const place = document.getElementById(button.dataset.csv);
      await draw(place);
      const rows = place._fullData.filter((trace) => trace.x && trace.y).flatMap(cells);
      const link = document.createElement('a');
      link.download = `${button.dataset.csv}.csv`;
      link.href = URL.createObjectURL(new Blob([['trace,x,y', ...rows].join('\n')]));
      link.click();
    }),
  );
})();
