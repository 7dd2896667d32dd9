printf "\037\213\010\000nonsense" > v.inr.gz
texel bake v.inr.gz --iso 1 -o x.texel
