texel help view > a.txt && texel view --help > b.txt && cmp a.txt b.txt && head -n 1 a.txt
