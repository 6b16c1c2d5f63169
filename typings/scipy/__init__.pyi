# Types of what the package calls in SciPy, which ships none. Without them the checker infers them from SciPy's
# sources, at the price of a minute; what is not declared here it still finds there.
