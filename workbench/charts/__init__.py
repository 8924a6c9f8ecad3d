"""Charts that can be zoomed, of the pages and of a report: what is drawn, and as which bytes it goes there."""
