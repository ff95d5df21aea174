"""Pages in a browser, as their readers see them."""

from contextlib import contextmanager

COUNT_FRAMES = """
    window.drawn = 0;
    const request = window.requestAnimationFrame;
    window.requestAnimationFrame = (f) => request((now) => { window.drawn++; f(now); });
"""


@contextmanager
def opened(browser, path, width=1000, height=900, **options):
    """The page in a context of its own; that nothing is asked for but the file, and nothing goes wrong, is asserted."""
    context = browser.new_context(viewport={"width": width, "height": height}, **options)
    page, trouble, requests = context.new_page(), [], []
    page.on("console", lambda message: trouble.append(message.text))
    page.on("pageerror", lambda error: trouble.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.add_init_script(COUNT_FRAMES)
    page.goto(path.as_uri())
    try:
        yield page
        assert trouble == [] and requests == [path.as_uri()]
    finally:
        context.close()
